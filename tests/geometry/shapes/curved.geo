// Half of a symmetric pair with curved surfaces, x >= 0; the upper body is pressed down. Radius of the upper surface: 1.
// 1 punch with rounded edges, 2 cone, 3 ball in a socket, 4 flanks of gears
DefineConstant[ shape = {1, Name "shape"} ];
DefineConstant[ n = {8, Name "n"} ]; // elements along the radius, upper surface
DefineConstant[ m = {0, Name "m"} ]; // the same, lower surface; n if 0
If (m == 0)
  m = n;
EndIf
size = 0.5;                 // of elements far from the contact
depth = 12;                 // of the lower body

If (shape == 1)
  Point(1) = {0, 0, 0, 1/n};
  Point(2) = {1, 0, 0, 1/n};
  Point(3) = {1, 1, 0};
  Point(4) = {2, 1, 0, 1/n};
  Line(1) = {1, 2};
  Circle(2) = {2, 3, 4};
  width = 2;
EndIf
If (shape == 2)
  Point(1) = {0, 0, 0, 1/n};
  Point(4) = {1, 0.1, 0, 1/n};
  Line(2) = {1, 4};
  width = 1;
EndIf
If (shape >= 3)
  Point(1) = {0, 0, 0, 1/n};
  Point(3) = {0, 1, 0};
  Point(4) = {1, 1, 0, 1/n};
  Circle(2) = {1, 3, 4};
  width = 1;
EndIf
Point(5) = {width, 2, 0, size};
Point(6) = {0, 2, 0, size};
Line(3) = {4, 5};
Line(4) = {5, 6};
Line(5) = {6, 1};
If (shape == 1)
  Curve Loop(1) = {1, 2, 3, 4, 5};
Else
  Curve Loop(1) = {2, 3, 4, 5};
EndIf
Plane Surface(1) = {1};

Point(11) = {0, 0, 0, 1/m};
If (shape <= 2)
  Point(12) = {width + 3, 0, 0, 1/m};
  Point(13) = {depth, 0, 0, 4*size};
  Point(14) = {depth, -depth, 0, 4*size};
  Point(15) = {0, -depth, 0, 4*size};
  Line(11) = {11, 12};
  Line(12) = {12, 13};
  Line(13) = {13, 14};
  Line(14) = {14, 15};
  Curve Loop(2) = {11, 12, 13, 14, 15};
EndIf
If (shape == 3)
  Point(12) = {1.05, 1.05, 0, 1/m};
  Point(13) = {0, 1.05, 0};
  Point(14) = {3, 1.05, 0, size};
  Point(16) = {3, -2, 0, size};
  Point(15) = {0, -2, 0, size};
  Circle(11) = {11, 13, 12};
  Line(12) = {12, 14};
  Line(13) = {14, 16};
  Line(14) = {16, 15};
  Curve Loop(2) = {11, 12, 13, 14, 15};
EndIf
If (shape == 4)
  Point(12) = {2, -2, 0, 1/m};
  Point(13) = {0, -2, 0};
  Point(14) = {2, -3, 0, size};
  Point(15) = {0, -3, 0, size};
  Circle(11) = {11, 13, 12};
  Line(12) = {12, 14};
  Line(14) = {14, 15};
  Curve Loop(2) = {11, 12, 14, 15};
EndIf
Line(15) = {15, 11};
Plane Surface(2) = {2};

Physical Surface("upper") = {1};
Physical Surface("lower") = {2};
Physical Curve("upper_face") = {2};
If (shape == 1)
  Physical Curve("upper_face") += {1};
EndIf
Physical Curve("upper_top") = {4};
Physical Curve("upper_axis") = {5};
Physical Curve("lower_face") = {11};
Physical Curve("lower_axis") = {15};
Physical Curve("lower_base") = {14};
