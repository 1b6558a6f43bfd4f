// A cube of k x k x k blocks of side 1 with n elements a side each. Nothing is shared, so that `between = "auto"` finds the joints. Blocks are
// numbered along x, then y, then z; the outer faces have groups of their own.
DefineConstant[ k = {3, Name "k"} ];
DefineConstant[ n = {2, Name "n"} ];
b = 0;
For z In {0 : k - 1}
For y In {0 : k - 1}
For x In {0 : k - 1}
    b += 1;
    p = 8*(b - 1) + 1;
    Point(p) = {x, y, z}; Point(p+1) = {x+1, y, z}; Point(p+2) = {x+1, y+1, z}; Point(p+3) = {x, y+1, z};
    Point(p+4) = {x, y, z+1}; Point(p+5) = {x+1, y, z+1}; Point(p+6) = {x+1, y+1, z+1}; Point(p+7) = {x, y+1, z+1};
    l = 12*(b - 1) + 1;
    Line(l) = {p, p+1}; Line(l+1) = {p+1, p+2}; Line(l+2) = {p+3, p+2}; Line(l+3) = {p, p+3};
    Line(l+4) = {p+4, p+5}; Line(l+5) = {p+5, p+6}; Line(l+6) = {p+7, p+6}; Line(l+7) = {p+4, p+7};
    Line(l+8) = {p, p+4}; Line(l+9) = {p+1, p+5}; Line(l+10) = {p+2, p+6}; Line(l+11) = {p+3, p+7};
    f = 6*(b - 1) + 1;
    Curve Loop(f) = {l, l+1, -(l+2), -(l+3)}; Curve Loop(f+1) = {l+4, l+5, -(l+6), -(l+7)};
    Curve Loop(f+2) = {l, l+9, -(l+4), -(l+8)}; Curve Loop(f+3) = {l+1, l+10, -(l+5), -(l+9)};
    Curve Loop(f+4) = {l+2, l+10, -(l+6), -(l+11)}; Curve Loop(f+5) = {l+3, l+11, -(l+7), -(l+8)};
    For i In {0 : 5}
      Plane Surface(f+i) = {f+i};
    EndFor
    Surface Loop(b) = {f : f + 5};
    Volume(b) = {b};
    Transfinite Curve {l : l + 11} = n + 1;
    Transfinite Surface {f : f + 5};
    Transfinite Volume {b};
    Physical Volume(Sprintf("b%g", b)) = {b};
    If (z == 0)
      Physical Surface(Sprintf("b%g_bottom", b)) = {f};
    EndIf
    If (z == k - 1)
      Physical Surface(Sprintf("b%g_top", b)) = {f+1};
    EndIf
    If (y == 0)
      Physical Surface(Sprintf("b%g_front", b)) = {f+2};
    EndIf
    If (x == k - 1)
      Physical Surface(Sprintf("b%g_right", b)) = {f+3};
    EndIf
    If (y == k - 1)
      Physical Surface(Sprintf("b%g_back", b)) = {f+4};
    EndIf
    If (x == 0)
      Physical Surface(Sprintf("b%g_left", b)) = {f+5};
    EndIf
EndFor
EndFor
EndFor
