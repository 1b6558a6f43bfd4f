// Two blocks, one on the other, that share no point: contact is found between their surfaces.
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.1, Name "size"} ]; // of the elements on the contact; `--set mesh.set.size=0.05` makes it finer

length = 2; // half of the block: x = 0 is its axis
height = 1;

Rectangle(1) = {0, 0, 0, length, height};
Rectangle(2) = {0, height, 0, length, height};

// Elements grow away from the contact.
MeshSize {:} = 4*size;
MeshSize {3, 4, 5, 6} = size;

// Names for the scene. A rectangle has the lines bottom, right, top, left.
Physical Surface("lower") = {1};
Physical Curve("lower_bottom") = {1};
Physical Curve("lower_top") = {3};
Physical Curve("lower_axis") = {4};
Physical Surface("upper") = {2};
Physical Curve("upper_bottom") = {5};
Physical Curve("upper_top") = {7};
Physical Curve("upper_axis") = {8};
