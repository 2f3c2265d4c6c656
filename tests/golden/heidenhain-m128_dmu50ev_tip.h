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
21 ;   Y and Z move together
22 ; B count as on this control, opposite to tool relative to workpiece
23 L M129
24 L M127
25 L B+90.0000 C+0.0000 R0 FMAX
26 L M128
27 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
28 L X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
29 L X-79.7353 Y-130.4391 Z+286.3885 B+85.0000 C+10.0000 R0 F2618.508
30 L X-3.8332 Y-152.8312 Z+286.3885 B+85.0000 C+40.0000 R0 F11870.427
31 L X+7.5826 Y-173.1032 Z+261.5213 B+98.0000 C+40.0000 R0 F8172.880
32 L X+2.4741 Y-199.6960 Z+274.4337 B+98.0000 C+40.0000 R0 FMAX
33 L M129
34 L M5
35 L M9
36 L M30
37 END PGM PART MM
