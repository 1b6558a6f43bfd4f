// The blocks of ../groove/groove.geo meshed freely: elements are small at the edge of the groove and where the contact ends,
// larger along the contact, and largest away from it.
DefineConstant[ n = {2, Name "n"} ]; // fineness; 1 is the coarsest that makes sense

length = 4;
height = 1;
edge = 3;       // of the groove
end = 3.45435;  // of the contact for B = 2.5e-5, a = 0.5; near it for other layers

far = 0.5/Sqrt(n);    // size away from the contact
near = 0.15/n;        // along the contact
tip = 0.05/(n*n);     // at the edge and at the end
growth = 0.5/Sqrt(n); // of the size with the distance

Point(1) = {0, 0, 0};
Point(2) = {length, 0, 0};
Point(3) = {length, height, 0};
Point(4) = {end, height, 0};
Point(5) = {edge, height, 0};
Point(6) = {0, height, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {6, 5};
Line(4) = {5, 4};
Line(5) = {4, 3};
Line(6) = {6, 1};

// The mirror image about y = height, with nothing shared.
Point(11) = {0, 2*height, 0};
Point(12) = {length, 2*height, 0};
Point(13) = {length, height, 0};
Point(14) = {end, height, 0};
Point(15) = {edge, height, 0};
Point(16) = {0, height, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {16, 15};
Line(14) = {15, 14};
Line(15) = {14, 13};
Line(16) = {16, 11};

Curve Loop(1) = {1, 2, -5, -4, -3, 6};
Curve Loop(2) = {-11, -16, 13, 14, 15, -12};
Plane Surface(1) = {1};
Plane Surface(2) = {2};

Field[1] = MathEval;
Field[1].F = Sprintf("min(%g, min(%g + %g*abs(y - %g), %g + %g*sqrt(min((x - %g)^2, (x - %g)^2) + (y - %g)^2)))",
  far, near, growth, height, tip, growth, edge, end, height);
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Surface("lower") = {1};
Physical Surface("upper") = {2};
Physical Curve("lower_face") = {1};
Physical Curve("lower_axis") = {2};
Physical Curve("lower_top") = {3, 4, 5};
Physical Curve("lower_end") = {6};
Physical Curve("upper_face") = {11};
Physical Curve("upper_axis") = {12};
Physical Curve("upper_bottom") = {13, 14, 15};
Physical Curve("upper_end") = {16};
