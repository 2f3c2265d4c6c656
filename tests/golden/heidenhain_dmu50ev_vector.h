0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; control: heidenhain vector
3 ; tool: ball:10
4 ; source: five-points.apt
5 ; energy: 7424 J [feed drives]
6 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
7 ;   collisions of this motion
8 ; X Y Z are the tool tip's on the workpiece, which turns with the table [FUNCTION
9 ;   TCPM]; F is the tip's
10 ; directions of the tool are written, and the control chooses its rotary angles
11 ;   for them: they may be others than those that were optimised and verified
12 ; not written: tool change, spindle speed, coolant, safe retract; see to it before
13 ;   the start
14 ; zero: the work offset is the workpiece origin, with every axis at 0
15 ; tool length: words are the tip's, and the control adds the length of the loaded
16 ;   tool: measure it
17 ; rapid moves are taken to run straight, all axes arriving together: L does so
18 ; start with the tool clear of part and table: first the rotary axes turn, then X,
19 ;   Y and Z go to a point above the path, then Z comes down
20 FUNCTION RESET TCPM
21 PLANE RESET STAY
22 CYCL DEF 7.0 DATUM SHIFT
23 CYCL DEF 7.1 X+0
24 CYCL DEF 7.2 Y+0
25 CYCL DEF 7.3 Z+0
26 CYCL DEF 8.0 MIRROR IMAGE
27 CYCL DEF 8.1
28 CYCL DEF 10.0 ROTATION
29 CYCL DEF 10.1 ROT+0
30 CYCL DEF 11.0 SCALING
31 CYCL DEF 11.1 SCL 1
32 L M127
33 CYCL DEF 32.0 TOLERANCE
34 CYCL DEF 32.1
35 L B+90.0000 C+0.0000 R0 FMAX
36 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR
37 L X-174.6554 Y-178.5000 Z+333.5000 R0 FMAX
38 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
39 LN X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
40 LN X-79.7353 Y-130.4391 Z+286.3885 TX-0.61445749 TY-0.57180861 TZ+0.54357787 R0 F2618.508
41 LN X-3.8332 Y-152.8312 Z+286.3885 TX-0.24623149 TY-0.80242953 TZ+0.54357787 R0 F11870.427
42 LN X+7.5826 Y-173.1032 Z+261.5213 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 F8172.880
43 LN X+2.4741 Y-199.6960 Z+274.4337 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 FMAX
44 FUNCTION RESET TCPM
45 L M5
46 L M9
47 L M30
48 END PGM PART MM
