// The blocks of the groove, 4 x 1, as a slice of space: one on the other with nothing shared, the groove's axis is x = 4.
SetFactory("OpenCASCADE");
DefineConstant[ n = {8, Name "n"} ];                   // elements through the height of a block; 4 n along it
DefineConstant[ thickness = {0.125, Name "thickness"} ];
DefineConstant[ layers = {Ceil(n*thickness - 0.001), Name "layers"} ]; // elements through the thickness; cubes unless given

// A box has 12 lines (along z y z y, z y z y, x x x x) and the faces x0 x1 y0 y1 z0 z1.
Box(1) = {0, 0, 0, 4, 1, thickness};
Box(2) = {0, 1, 0, 4, 1, thickness};
For line In {0 : 12 : 12}
  Transfinite Curve {line + 1, line + 3, line + 5, line + 7} = layers + 1;
  Transfinite Curve {line + 2, line + 4, line + 6, line + 8} = n + 1;
  Transfinite Curve {line + 9 : line + 12} = 4*n + 1;
EndFor
Transfinite Surface {1 : 12};
Transfinite Volume {1, 2};

Physical Volume("lower") = {1};
Physical Surface("lower_end") = {1};
Physical Surface("lower_axis") = {2};
Physical Surface("lower_face") = {3};
Physical Surface("lower_top") = {4};
Physical Surface("lower_sides") = {5, 6};
Physical Volume("upper") = {2};
Physical Surface("upper_end") = {7};
Physical Surface("upper_axis") = {8};
Physical Surface("upper_bottom") = {9};
Physical Surface("upper_face") = {10};
Physical Surface("upper_sides") = {11, 12};
