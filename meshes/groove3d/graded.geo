// The blocks of ../groove-held, 4 x 1 in the plane and 1 thick: elements are small where the pressure changes, and `long` times
// longer across than there. They are smallest around the edge of the groove, where the pressure bends most, and grow with the
// distance from there.
DefineConstant[ n = {1, Name "n"} ];         // fineness
DefineConstant[ long = {8, Name "long"} ];   // length along z over the least size in the plane
DefineConstant[ thickness = {1, Name "thickness"} ];

length = 4;
height = 1;
edge = 3;       // of the groove
end = 3.45435;  // of the contact for B = 2.5e-5, a = 0.5; near it for other layers

far = 0.8/n;     // size away from the contact
near = 0.3/n;    // along the contact
rise = 0.5/n;    // its growth with the height above the contact
tip = 0.056/n;   // size around the edge
growth = 0.45/n; // its growth with the distance
before = 0.15;   // where the small elements begin, before the edge
behind = 0.25;   // where they end, behind it

apart = 1e-3;   // between the blocks: Gmsh merges extruded nodes that coincide, so the scene says `touching`
layers = Ceil(thickness/(0.75*long*tip)); // the least edges in the plane are 0.75 tip

For body In {0 : 1}
  p = 10*body;
  y = height + body*apart;
  Point(p + 1) = {0, y - height + 2*body*height, 0};
  Point(p + 2) = {length, y - height + 2*body*height, 0};
  Point(p + 3) = {length, y, 0};
  Point(p + 4) = {end, y, 0};
  Point(p + 5) = {edge, y, 0};
  Point(p + 6) = {0, y, 0};
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  Line(p + 4) = {p + 4, p + 5};
  Line(p + 5) = {p + 5, p + 6};
  Line(p + 6) = {p + 6, p + 1};
  Curve Loop(body + 1) = {p + 1 : p + 6};
  Plane Surface(body + 1) = {body + 1};
EndFor

Field[1] = MathEval;
Field[1].F = Sprintf("min(%g, min(%g + %g*abs(y - %g), %g + %g*sqrt(max(max(%g - x, x - %g), 0)^2 + (y - %g)^2)))",
  far, near, rise, height, tip, growth, edge - before, edge + behind, height);
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;

// An extruded surface has the opposite one first, then the volume, then the sides in the order of the lines.
low() = Extrude {0, 0, thickness} { Surface{1}; Layers{layers}; };
high() = Extrude {0, 0, thickness} { Surface{2}; Layers{layers}; };
Physical Volume("lower") = {low(1)};
Physical Surface("lower_face") = {low(2)};
Physical Surface("lower_axis") = {low(3)};
Physical Surface("lower_top") = {low(4), low(5), low(6)};
Physical Surface("lower_end") = {low(7)};
Physical Surface("lower_sides") = {1, low(0)};
Physical Volume("upper") = {high(1)};
Physical Surface("upper_face") = {high(2)};
Physical Surface("upper_axis") = {high(3)};
Physical Surface("upper_bottom") = {high(4), high(5), high(6)};
Physical Surface("upper_end") = {high(7)};
Physical Surface("upper_sides") = {2, high(0)};
