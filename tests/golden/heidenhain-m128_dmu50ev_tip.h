0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; control: heidenhain-m128 tip
3 ; positions: table
4 ; tool: ball:10
5 ; source: five-points.apt
6 ; energy: 7424 J [feed drives]
7 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
8 ;   collisions of this motion
9 ; X Y Z are the tool tip's on the workpiece, which turns with the table [M128]; F
10 ;   is the tip's
11 ; measure the tool's length to the tip itself: manuals of M128 want it to the
12 ;   centre of a ball end, and with that length these words lead a ball too deep by
13 ;   its radius
14 ; not written: tool change, spindle speed, coolant, safe retract; see to it before
15 ;   the start
16 ; zero: the work offset is the workpiece origin, with every axis at 0
17 ; tool length: words are the tip's, and the control adds the length of the loaded
18 ;   tool: measure it
19 ; rapid moves are taken to run straight, all axes arriving together: L does so
20 ; start with the tool clear of part and table: first the rotary axes turn, then X,
21 ;   Y and Z go to a point above the path, then Z comes down
22 ; B count as on this control, opposite to tool relative to workpiece
23 L M129
24 PLANE RESET STAY
25 CYCL DEF 7.0 DATUM SHIFT
26 CYCL DEF 7.1 X+0
27 CYCL DEF 7.2 Y+0
28 CYCL DEF 7.3 Z+0
29 CYCL DEF 8.0 MIRROR IMAGE
30 CYCL DEF 8.1
31 CYCL DEF 10.0 ROTATION
32 CYCL DEF 10.1 ROT+0
33 CYCL DEF 11.0 SCALING
34 CYCL DEF 11.1 SCL 1
35 L M127
36 CYCL DEF 32.0 TOLERANCE
37 CYCL DEF 32.1
38 L B+90.0000 C+0.0000 R0 FMAX
39 L M128
40 L X-174.6554 Y-178.5000 Z+333.5000 R0 FMAX
41 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
42 L X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
43 L X-79.7353 Y-130.4391 Z+286.3885 B+85.0000 C+10.0000 R0 F2618.508
44 L X-3.8332 Y-152.8312 Z+286.3885 B+85.0000 C+40.0000 R0 F11870.427
45 L X+7.5826 Y-173.1032 Z+261.5213 B+98.0000 C+40.0000 R0 F8172.880
46 L X+2.4741 Y-199.6960 Z+274.4337 B+98.0000 C+40.0000 R0 FMAX
47 L M129
48 L M5
49 L M9
50 L M30
51 END PGM PART MM
