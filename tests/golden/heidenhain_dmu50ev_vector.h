0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; tool: ball:10
3 ; source: five-points.apt
4 ; energy: 7424 J [feed drives]
5 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
6 ;   collisions of this motion
7 ; X Y Z are the tool tip's on the workpiece, which turns with the table [FUNCTION
8 ;   TCPM]; F is the tip's
9 ; directions of the tool are written, and the control chooses its rotary angles
10 ;   for them: they may be others than those that were optimised and verified
11 ; not written: tool change, spindle speed, coolant, safe retract; see to it before
12 ;   the start
13 ; zero: the work offset is the workpiece origin, with every axis at 0
14 ; tool length: words are the tip's, and the control adds the length of the loaded
15 ;   tool: measure it
16 ; rapid moves are taken to run straight, all axes arriving together: L does so
17 ; start with the tool clear of part and table: first the rotary axes turn, then X,
18 ;   Y and Z move together
19 FUNCTION RESET TCPM
20 L M127
21 L B+90.0000 C+0.0000 R0 FMAX
22 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR
23 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
24 LN X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
25 LN X-79.7353 Y-130.4391 Z+286.3885 TX-0.61445749 TY-0.57180861 TZ+0.54357787 R0 F2618.508
26 LN X-3.8332 Y-152.8312 Z+286.3885 TX-0.24623149 TY-0.80242953 TZ+0.54357787 R0 F11870.427
27 LN X+7.5826 Y-173.1032 Z+261.5213 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 F8172.880
28 LN X+2.4741 Y-199.6960 Z+274.4337 TX-0.17028050 TY-0.88642474 TZ+0.43041345 R0 FMAX
29 FUNCTION RESET TCPM
30 L M5
31 L M9
32 L M30
33 END PGM PART MM
