// k x k x k blocks in space, beside and on each other with nothing shared, numbered along x, then y, then z.
DefineConstant[ k = {3, Name "k"} ];       // blocks along an edge
DefineConstant[ size = {0.1, Name "size"} ];
DefineConstant[ n = {2, Name "n"} ];       // elements along an edge of a block

// edges of a block between its corners: those of both faces z, and the four between them
from() = {1, 2, 3, 4, 5, 6, 7, 8, 1, 2, 3, 4};
to() = {2, 3, 4, 1, 6, 7, 8, 5, 5, 6, 7, 8};
x0() = {}; x1() = {}; y0() = {}; y1() = {}; z0() = {}; z1() = {};
For z In {0 : k - 1}
  For y In {0 : k - 1}
    For x In {0 : k - 1}
      block = (z*k + y)*k + x;
      p = 8*block;
      e = 12*block;
      f = 6*block;
      For up In {0 : 1}
        Point(p + 4*up + 1) = {x*size, y*size, (z + up)*size};
        Point(p + 4*up + 2) = {(x + 1)*size, y*size, (z + up)*size};
        Point(p + 4*up + 3) = {(x + 1)*size, (y + 1)*size, (z + up)*size};
        Point(p + 4*up + 4) = {x*size, (y + 1)*size, (z + up)*size};
      EndFor
      For edge In {1 : 12}
        Line(e + edge) = {p + from(edge - 1), p + to(edge - 1)};
      EndFor
      Curve Loop(f + 1) = {-(e + 4), e + 12, e + 8, -(e + 9)};  // x = 0
      Curve Loop(f + 2) = {e + 2, e + 11, -(e + 6), -(e + 10)}; // x = size
      Curve Loop(f + 3) = {e + 1, e + 10, -(e + 5), -(e + 9)};  // y = 0
      Curve Loop(f + 4) = {e + 3, e + 12, -(e + 7), -(e + 11)}; // y = size
      Curve Loop(f + 5) = {e + 1, e + 2, e + 3, e + 4};         // z = 0
      Curve Loop(f + 6) = {e + 5, e + 6, e + 7, e + 8};         // z = size
      For face In {1 : 6}
        Plane Surface(f + face) = {f + face};
      EndFor
      Surface Loop(block + 1) = {f + 1 : f + 6};
      Volume(block + 1) = {block + 1};
      Transfinite Curve {e + 1 : e + 12} = n + 1;
      // corners in the order in which the triangles fit the tetrahedra
      Transfinite Surface {f + 1} = {p + 1, p + 4, p + 8, p + 5};
      Transfinite Surface {f + 2} = {p + 2, p + 3, p + 7, p + 6};
      Transfinite Surface {f + 3} = {p + 1, p + 2, p + 6, p + 5};
      Transfinite Surface {f + 4} = {p + 4, p + 3, p + 7, p + 8};
      Transfinite Surface {f + 5} = {p + 1 : p + 4};
      Transfinite Surface {f + 6} = {p + 5 : p + 8};
      Transfinite Volume {block + 1} = {p + 1 : p + 8};
      Physical Volume(Sprintf("block_%g", block + 1)) = {block + 1};
      If (x == 0)
        x0() += f + 1;
      EndIf
      If (x == k - 1)
        x1() += f + 2;
      EndIf
      If (y == 0)
        y0() += f + 3;
      EndIf
      If (y == k - 1)
        y1() += f + 4;
      EndIf
      If (z == 0)
        z0() += f + 5;
      EndIf
      If (z == k - 1)
        z1() += f + 6;
      EndIf
    EndFor
  EndFor
EndFor
Physical Surface("x0") = {x0()};
Physical Surface("x1") = {x1()};
Physical Surface("y0") = {y0()};
Physical Surface("y1") = {y1()};
Physical Surface("z0") = {z0()};
Physical Surface("z1") = {z1()};
