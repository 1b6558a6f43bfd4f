// Two cylinders, one on the other, by their halves in the half-plane x >= 0: x is the radius, y runs along the axis.
// They share no point: contact is found between their surfaces.
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.1, Name "size"} ]; // of the elements on the contact; `--set mesh.set.size=0.05` makes it finer

radius = 2;
height = 2;

Rectangle(1) = {0, 0, 0, radius, height};
Rectangle(2) = {0, height, 0, radius, height};

// Elements grow away from the contact.
MeshSize {:} = 4*size;
MeshSize {3, 4, 5, 6} = size;

// Names for the scene. A rectangle has the lines bottom, right, top, left; the left ones are on the axis and need no name.
Physical Surface("lower") = {1};
Physical Curve("lower_bottom") = {1};
Physical Curve("lower_top") = {3};
Physical Surface("upper") = {2};
Physical Curve("upper_bottom") = {5};
Physical Curve("upper_top") = {7};
