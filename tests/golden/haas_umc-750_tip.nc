%
O0012
(machine: umc-750, form-shaping code 650123)
(control: haas tip)
(positions: table)
(tool: ball:10)
(verification: NOT VERIFIED, nobody has checked limits,)
(  contact, gouges or collisions of this motion)
(zero: the workpiece origin, every axis at 0)
(length: to the tip, the control adds that of the loaded tool)
(approach: rotary axes, to straight above the path, then Z)
(source: five-points.apt)
(energy: 7424 J [feed drives])
N10 G21 G90 G94 G17 G40 G49 G80
N20 G69
N30 G50
N40 G100 X0 Y0 Z0
N50 G52 X0 Y0 Z0
N60 G255
N70 G269
N80 G187
N90 G154 P3
N100 G53 G0 Z0.0000
N110 T3 M6
N120 M11
N130 M13
N140 S8000 M3
N150 M8
N160 G0 B37.5000 C0.0000
N170 G0 G234 H3 X76.0318 Y0.0000 Z99.0866
N180 G0 X3.0438 Y0.0000 Z3.9668
N190 G94
N200 G1 X0.0000 Y0.0000 Z0.0000 F600.000
N210 G1 X0.1530 Y4.0887 Z-3.5013 B42.5000 C10.0000 F600.000
N220 G1 X-1.9119 Y3.6174 Z-3.5013 B42.5000 C40.0000 F1000.000
N230 G1 X-10.0750 Y3.2947 Z4.3173 B29.5000 C40.0000 F600.000
N240 G0 X1.2416 Y12.7905 Z30.4280 B29.5000 C40.0000
N250 G49
N260 G53 G0 Z0.0000
N270 M5
N280 M9
N290 G53 G0 X0.0000 Y0.0000
N300 M30
%
