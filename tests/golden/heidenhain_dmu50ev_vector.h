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
19 ;   Y and Z move together
20 FUNCTION RESET TCPM
21 L M127
22 L B+90.0000 C+0.0000 R0 FMAX
23 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR
24 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
25 LN X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
26 LN X-79.7353 Y-130.4391 Z+286.3885 TX-0.61445749 TY-0.57180861 TZ+0.54357787 R0 F2618.508
27 LN X-3.8332 Y-152.8312 Z+286.3885 TX-0.24623149 TY-0.80242953 TZ+0.54357787 R0 F11870.427
28 LN X+7.5826 Y-173.1032 Z+261.5213 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 F8172.880
29 LN X+2.4741 Y-199.6960 Z+274.4337 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 FMAX
30 FUNCTION RESET TCPM
31 L M5
32 L M9
33 L M30
34 END PGM PART MM
