0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; tool: ball:10
3 ; source: five-points.apt
4 ; energy: 7424 J [feed drives]
5 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
6 ;   collisions of this motion
7 ; X Y Z are the tool tip's on the workpiece, which turns with the table [FUNCTION
8 ;   TCPM]; F is the tip's
9 ; zero: the work offset is the workpiece origin, with every axis at 0
10 ; tool length: words are the tip's, and the control adds the length of the loaded
11 ;   tool: measure it
12 ; rapid moves are taken to run straight, all axes arriving together: L does so
13 ; start with the tool clear of part and table: first the rotary axes turn, then X,
14 ;   Y and Z move together
15 ; B count as on this control, opposite to tool relative to workpiece
16 FUNCTION RESET TCPM
17 L M127
18 L Z+0.0000 R0 FMAX M91
19 TOOL CALL 3 Z
20 TOOL CALL Z S8000
21 L M3
22 L M8
23 L B+90.0000 C+0.0000 R0 FMAX
24 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS
25 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
26 L X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
27 L X-79.7353 Y-130.4391 Z+286.3885 B+85.0000 C+10.0000 R0 F2618.508
28 L X-3.8332 Y-152.8312 Z+286.3885 B+85.0000 C+40.0000 R0 F11870.427
29 L X+7.5826 Y-173.1032 Z+261.5213 B+98.0000 C+40.0000 R0 F8172.880
30 L X+2.4741 Y-199.6960 Z+274.4337 B+98.0000 C+40.0000 R0 FMAX
31 FUNCTION RESET TCPM
32 L Z+0.0000 R0 FMAX M91
33 L M5
34 L M9
35 L X+0.0000 Y+0.0000 R0 FMAX M91
36 L M30
37 END PGM PART MM
