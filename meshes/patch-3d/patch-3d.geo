// Two unit cubes, one on the other with nothing shared, and any numbers of elements along each edge.
SetFactory("OpenCASCADE");
DefineConstant[ nl = {3, Name "nl"} ]; // elements along each edge of the lower cube
DefineConstant[ nu = {2, Name "nu"} ]; // and of the upper one
DefineConstant[ structured = {1, Name "structured"} ]; // 0: elements as Gmsh likes them

// A box has 8 points, 12 lines and the faces x0 x1 y0 y1 z0 z1.
Box(1) = {0, 0, 0, 1, 1, 1};
Box(2) = {0, 0, 1, 1, 1, 1};
Transfinite Curve {1:12} = nl + 1;
Transfinite Curve {13:24} = nu + 1;
If(structured)
  Transfinite Surface {1:12};
  Transfinite Volume {1, 2};
EndIf

Physical Volume("lower") = {1};
Physical Surface("lower_bottom") = {5};
Physical Surface("lower_top") = {6};
Physical Point("lower_pin") = {2};  // (0, 0, 0)
Physical Point("lower_spin") = {6}; // (1, 0, 0)
Physical Volume("upper") = {2};
Physical Surface("upper_bottom") = {11};
Physical Surface("upper_top") = {12};
Physical Point("upper_pin") = {10};
Physical Point("upper_spin") = {14};
