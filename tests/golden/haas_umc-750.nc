%
O0001
(machine: umc-750, form-shaping code 650123)
(control: haas axes)
(tool: ball:10)
(verification: NOT VERIFIED, nobody has checked limits,)
(  contact, gouges or collisions of this motion)
(operator: tool change, spindle speed, coolant, safe retract)
(zero: at X0 Y0 Z0 B0 C0 the tip is at the workpiece origin)
(length: to the tip, the control adds that of the loaded tool)
(approach: rotary axes, X and Y, then Z)
(assumed: no tool number was given: H1 is written)
(assumed: no program number was given: 1 is written)
(source: five-points.apt)
(energy: 7424 J [feed drives])
G21 G90 G94 G17 G40 G49 G80
G69
G50
G100 X0 Y0 Z0
G52 X0 Y0 Z0
G255
G269
G187
G54
M11
M13
G0 B37.5000 C0.0000
G0 X0.0000 Y0.0000
G0 G43 H1 Z5.0000
G93
G1 X0.0000 Y0.0000 Z0.0000 B37.5000 C0.0000 F120.000
G1 X3.0000 Y4.0000 Z-2.0000 B42.5000 C10.0000 F120.000
G1 B42.5000 C40.0000 F150.000
G1 X-7.0000 Y9.0000 Z1.0000 B29.5000 C40.0000 F240.000
G0 X-7.0000 Y9.0000 Z31.0000 B29.5000 C40.0000
G94
G49
M5
M9
M30
%
