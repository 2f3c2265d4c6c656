0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; control: heidenhain tip
3 ; positions: table
4 ; tool: ball:10
5 ; source: five-points.apt
6 ; energy: 7424 J [feed drives]
7 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
8 ;   collisions of this motion
9 ; X Y Z are the tool tip's on the workpiece, which turns with the table [FUNCTION
10 ;   TCPM]; F is the tip's
11 ; zero: the work offset is the workpiece origin, with every axis at 0
12 ; tool length: words are the tip's, and the control adds the length of the loaded
13 ;   tool: measure it
14 ; rapid moves are taken to run straight, all axes arriving together: L does so
15 ; start with the tool clear of part and table: first the rotary axes turn, then X,
16 ;   Y and Z go to a point above the path, then Z comes down
17 ; B count as on this control, opposite to tool relative to workpiece
18 FUNCTION RESET TCPM
19 PLANE RESET STAY
20 CYCL DEF 7.0 DATUM SHIFT
21 CYCL DEF 7.1 X+0
22 CYCL DEF 7.2 Y+0
23 CYCL DEF 7.3 Z+0
24 CYCL DEF 8.0 MIRROR IMAGE
25 CYCL DEF 8.1
26 CYCL DEF 10.0 ROTATION
27 CYCL DEF 10.1 ROT+0
28 CYCL DEF 11.0 SCALING
29 CYCL DEF 11.1 SCL 1
30 L M127
31 CYCL DEF 32.0 TOLERANCE
32 CYCL DEF 32.1
33 L Z+0.0000 R0 FMAX M91
34 TOOL CALL 3 Z
35 TOOL CALL Z S8000
36 L M3
37 L M8
38 L B+90.0000 C+0.0000 R0 FMAX
39 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS
40 L X-174.6554 Y-178.5000 Z+333.5000 R0 FMAX
41 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
42 L X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
43 L X-79.7353 Y-130.4391 Z+286.3885 B+85.0000 C+10.0000 R0 F2618.508
44 L X-3.8332 Y-152.8312 Z+286.3885 B+85.0000 C+40.0000 R0 F11870.427
45 L X+7.5826 Y-173.1032 Z+261.5213 B+98.0000 C+40.0000 R0 F8172.880
46 L X+2.4741 Y-199.6960 Z+274.4337 B+98.0000 C+40.0000 R0 FMAX
47 FUNCTION RESET TCPM
48 L Z+0.0000 R0 FMAX M91
49 L M5
50 L M9
51 L X+0.0000 Y+0.0000 R0 FMAX M91
52 L M30
53 END PGM PART MM
