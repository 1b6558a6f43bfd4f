// Blocks in `rows` storeys of `columns` in space, each beside and on the other with nothing shared, and each with a mesh of its own:
// meshes/stack/stack.geo with a depth. y is up.
SetFactory("OpenCASCADE");
DefineConstant[ rows = {2, Name "rows"} ];       // storeys
DefineConstant[ columns = {1, Name "columns"} ]; // blocks in a storey
DefineConstant[ width = {1, Name "width"} ];     // of a block
DefineConstant[ height = {1, Name "height"} ];
DefineConstant[ depth = {1, Name "depth"} ];
DefineConstant[ n1 = {2, Name "n1"} ];           // elements along the width of block 1
DefineConstant[ n2 = {2, Name "n2"} ];
DefineConstant[ n3 = {2, Name "n3"} ];
DefineConstant[ n4 = {2, Name "n4"} ];

n() = {n1, n2, n3, n4};

// A box has 8 points, 12 lines and the faces x0 x1 y0 y1 z0 z1.
For row In {0 : rows - 1}
  For column In {0 : columns - 1}
    block = row*columns + column;
    name = block + 1;
    along = n(block % 4);
    Box(name) = {column*width, row*height, 0, width, height, depth};
    For line In {1 : 4}
      Transfinite Curve {12*block + 8 + line} = along + 1;
      Transfinite Curve {12*block + 2*line} = Max(1, Min(4, Round(along*height/width))) + 1;
      Transfinite Curve {12*block + 2*line - 1} = Max(1, Min(4, Round(along*depth/width))) + 1;
    EndFor
    Transfinite Surface {6*block + 1 : 6*block + 6};
    Transfinite Volume {name};
    Physical Volume(Sprintf("b%g", name)) = {name};
    Physical Surface(Sprintf("b%g_left", name)) = {6*block + 1};
    Physical Surface(Sprintf("b%g_right", name)) = {6*block + 2};
    Physical Surface(Sprintf("b%g_bottom", name)) = {6*block + 3};
    Physical Surface(Sprintf("b%g_top", name)) = {6*block + 4};
    Physical Surface(Sprintf("b%g_front", name)) = {6*block + 5};
    Physical Surface(Sprintf("b%g_back", name)) = {6*block + 6};
    Physical Point(Sprintf("b%g_pin", name)) = {8*block + 4};  // upper left, in front
    Physical Point(Sprintf("b%g_spin", name)) = {8*block + 8}; // upper right
  EndFor
EndFor
