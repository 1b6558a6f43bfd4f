// A ring about the origin in four pieces, called after where they lie; the joints are on the diagonals. Nothing is shared:
// each piece has its own nodes, and its own number of elements along a joint, so that no two meshes match.
SetFactory("OpenCASCADE");
DefineConstant[ n = {4, Name "n"} ]; // elements along a joint, at least; towards its inner end they are half as long
DefineConstant[ a = {1, Name "a"} ]; // inner radius
DefineConstant[ b = {2, Name "b"} ]; // outer radius

// Piece s lies around the angle s*90 degrees. Its arcs are two curves each, so that loads and supports can be in the middle.
For s In {0 : 3}
  p = 10*s + 1;
  middle = s*Pi/2;
  from = middle - Pi/4;
  to = middle + Pi/4;
  Point(p) = {a*Cos(from), a*Sin(from), 0};
  Point(p + 1) = {b*Cos(from), b*Sin(from), 0};
  Point(p + 2) = {b*Cos(middle), b*Sin(middle), 0};
  Point(p + 3) = {b*Cos(to), b*Sin(to), 0};
  Point(p + 4) = {a*Cos(to), a*Sin(to), 0};
  Point(p + 5) = {a*Cos(middle), a*Sin(middle), 0};
  Point(p + 6) = {0, 0, 0};
  Line(p) = {p, p + 1};
  Circle(p + 1) = {p + 1, p + 6, p + 2};
  Circle(p + 2) = {p + 2, p + 6, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  Circle(p + 4) = {p + 4, p + 6, p + 5};
  Circle(p + 5) = {p + 5, p + 6, p};
  Curve Loop(p) = {p, p + 1, p + 2, p + 3, p + 4, p + 5};
  Plane Surface(p) = {p};
  Transfinite Curve {p, -(p + 3)} = n + s + 1 Using Progression 2^(1/(n + s - 1));
  Transfinite Curve {p + 1, p + 2} = n + s + 1;
  Transfinite Curve {p + 4, p + 5} = n + s + 1;
EndFor

Physical Surface("right") = {1};
Physical Curve("right_down") = {1}; // towards the piece below
Physical Curve("right_outer") = {2, 3};
Physical Curve("right_up") = {4};
Physical Point("right_pin") = {3};
Physical Point("right_pin_inside") = {6};
Physical Surface("top") = {11};
Physical Curve("top_right") = {11};
Physical Curve("top_outer") = {12, 13};
Physical Curve("top_outer_right") = {12};
Physical Curve("top_left") = {14};
Physical Point("top_pin") = {13};
Physical Surface("left") = {21};
Physical Curve("left_up") = {21};
Physical Curve("left_outer") = {22, 23};
Physical Curve("left_down") = {24};
Physical Surface("bottom") = {31};
Physical Curve("bottom_left") = {31};
Physical Curve("bottom_outer") = {32, 33};
Physical Curve("bottom_right") = {34};
Physical Point("bottom_pin") = {33};
