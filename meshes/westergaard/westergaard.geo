// Half a wavelength of two blocks of height L, which is as good as infinite. The lower surface is flat, the upper one is the
// wave y = D (1 - cos(2 pi x/L)): crests at x = 0 and x = L. Elements of size s/n over the contact |x| < s, growing in depth.
SetFactory("OpenCASCADE");
DefineConstant[ n = {8, Name "n"} ];    // elements along the half-width s of the contact, at least 4
DefineConstant[ L = {2, Name "L"} ];    // wavelength
DefineConstant[ D = {1e-4, Name "D"} ]; // amplitude

s = 0.27*L;  // under the load of the scene
knots = 128; // of the spline that stands for the wave, denser at its ends, where a spline has no curvature

Point(1) = {0, 0, 0};
Point(2) = {L/2, 0, 0};
Point(3) = {L/2, -L, 0};
Point(4) = {0, -L, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

For i In {0 : knots}
  Point(100 + i) = {L/4*(1 - Cos(Pi*i/knots)), D*(1 - Cos(Pi/2*(1 - Cos(Pi*i/knots)))), 0};
EndFor
Point(11) = {L/2, L, 0};
Point(12) = {0, L, 0};
Spline(11) = {100 : 100 + knots};
Line(12) = {100 + knots, 11};
Line(13) = {11, 12};
Line(14) = {12, 100};
Curve Loop(11) = {11, 12, 13, 14};
Plane Surface(11) = {11};

Field[1] = Box;
Field[1].XMax = L/2;
Field[1].YMin = -s/4;
Field[1].YMax = s/4;
Field[1].Thickness = L;
Field[1].VIn = s/n;
Field[1].VOut = L/4;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("lower") = {1};
Physical Curve("lower_top") = {1};
Physical Curve("lower_sides") = {2, 4};
Physical Curve("lower_face") = {3};
Physical Surface("upper") = {11};
Physical Curve("upper_bottom") = {11};
Physical Curve("upper_sides") = {12, 14};
Physical Curve("upper_face") = {13};
