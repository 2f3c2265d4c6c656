0 BEGIN PGM PART MM
1 ; machine: dmu50ev, form-shaping code 650123
2 ; control: heidenhain-m128 tip
3 ; positions: table
4 ; tool: ball:10
5 ; verification: NOT VERIFIED, nobody has checked limits, contact, gouges or
6 ;   collisions of this motion
7 ; operator: tool change, spindle speed, coolant, safe retract
8 ; zero: the workpiece origin, every axis at 0
9 ; length: to the tip, the control adds that of the loaded tool
10 ; approach: rotary axes, to straight above the path, then Z
11 ; source: five-points.apt
12 ; energy: 7424 J [feed drives]
13 L M129
14 PLANE RESET STAY
15 CYCL DEF 7.0 DATUM SHIFT
16 CYCL DEF 7.1 X+0
17 CYCL DEF 7.2 Y+0
18 CYCL DEF 7.3 Z+0
19 CYCL DEF 8.0 MIRROR IMAGE
20 CYCL DEF 8.1
21 CYCL DEF 10.0 ROTATION
22 CYCL DEF 10.1 ROT+0
23 CYCL DEF 11.0 SCALING
24 CYCL DEF 11.1 SCL 1
25 L M127
26 CYCL DEF 32.0 TOLERANCE
27 CYCL DEF 32.1
28 L B+90.0000 C+0.0000 R0 FMAX
29 L M128
30 L X-174.6554 Y-178.5000 Z+333.5000 R0 FMAX
31 L X-103.9447 Y-128.5000 Z+283.5000 R0 FMAX
32 L X-100.4092 Y-126.0000 Z+281.0000 R0 F600.000
33 L X-79.7353 Y-130.4391 Z+286.3885 B+85.0000 C+10.0000 R0 F600.000
34 L X-3.8332 Y-152.8312 Z+286.3885 B+85.0000 C+40.0000 R0 F1000.000
35 L X+7.5826 Y-173.1032 Z+261.5213 B+98.0000 C+40.0000 R0 F600.000
36 L X+2.4741 Y-199.6960 Z+274.4337 B+98.0000 C+40.0000 R0 FMAX
37 L M129
38 PLANE RESET STAY
39 L M5
40 L M9
41 L M30
42 END PGM PART MM
