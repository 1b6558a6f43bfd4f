// Two cubes on each other with nothing shared, tetrahedra graded from two numbers: the radius `a` of the contact around the corner
// x = y = 0, and the size `h` of elements where it ends. Inside they may be 1.25 h, and they grow with the distance from both. `n`
// divides all sizes, so that errors of all places fall together.
SetFactory("OpenCASCADE");
DefineConstant[ a = {0.2455, Name "a"} ];       // radius of the contact; near it for other layers and loads
DefineConstant[ h = {0.024, Name "h"} ];        // size of elements where contact ends
DefineConstant[ n = {1, Name "n"} ];            // divides all sizes
DefineConstant[ L = {0.5, Name "L"} ];          // side of the cubes

inside = 1.25*h; // size on the contact
growth = 0.35;   // of the size with the distance

If (h <= 0 || a <= 0 || L <= 0 || n <= 0)
  Error("h = %g, a = %g, L = %g and n = %g: take numbers above 0", h, a, L, n);
  Abort;
EndIf
// Corners of tetrahedra of size s: sqrt(2)/s^3 in a unit of volume, integrated over the sizes below. Gmsh makes 1e7 of them in a
// quarter of an hour, in 20 GB.
corners = n^3*Sqrt(2)*(Pi*a^2/4/(growth*inside^2) + Pi^2*a/(2*growth^2*h));
If (corners > 1e7)
  Error("h = %g makes some %.1e nodes around a contact of radius a = %g: take h = %.2g or more", h, corners, a, a/2000);
  Abort;
EndIf

Box(1) = {0, 0, -L, L, L, L};
Box(2) = {0, 0, 0, L, L, L};

Field[1] = MathEval;
Field[1].F = Sprintf("min(%g, min(%g + %g*sqrt(max(sqrt(x^2 + y^2) - %g, 0)^2 + z^2), %g + %g*sqrt((sqrt(x^2 + y^2) - %g)^2 + z^2)))/%g",
  L, inside, growth, a, h, growth, a, n);
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

Physical Volume("lower") = {1};
Physical Surface("lower_x") = {1, 2};
Physical Surface("lower_y") = {3, 4};
Physical Surface("lower_bottom") = {5};
Physical Surface("lower_top") = {6};
Physical Volume("upper") = {2};
Physical Surface("upper_x") = {7, 8};
Physical Surface("upper_y") = {9, 10};
Physical Surface("upper_bottom") = {11};
Physical Surface("upper_top") = {12};
