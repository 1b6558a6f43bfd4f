// Draws an eighth of a pipe joint and writes flange.step: two flanges with raised faces, 4.5 mm apart for the gasket, and half of one of
// the four bolts, cut through its shank at z = 0. The planes of symmetry are y = 0, through the bolt, and y = x, between two bolts.
//
//     gmsh flange.geo -0 -o flange.step
SetFactory("OpenCASCADE");

bore = 25;              // radius of the bore
pipe = 30;              // outer radius of the pipe
hub = 37.5;             // largest radius of the hub
raised = 51;            // radius of the raised face
rim = 82.5;             // radius of the flange
bolts = 62.5;           // radius of the circle of bolts
hole = 9;               // radius of a hole
shank = 8; head = 12;   // radii of the bolt, and of its head and nut
inner = 35; outer = 43; // radii of the gasket
gap = 2.25;             // half the thickness of the gasket
back = gap + 20;        // height of the back of the flange
end = 75;               // height of the end of the pipe

For side In {0 : 1}
  s = 1 - 2*side;       // 1 above z = 0, -1 below
  v = 100*side;

  p = newp;
  Point(p) = {bore, 0, s*gap};        Point(p + 1) = {raised, 0, s*gap};      Point(p + 2) = {raised, 0, s*(gap + 3)};
  Point(p + 3) = {rim, 0, s*(gap + 3)}; Point(p + 4) = {rim, 0, s*back};      Point(p + 5) = {hub, 0, s*back};
  Point(p + 6) = {hub, 0, s*(back + 5)}; Point(p + 7) = {pipe, 0, s*(back + 20)}; Point(p + 8) = {pipe, 0, s*end};
  Point(p + 9) = {bore, 0, s*end};
  l = newl;
  For k In {0 : 9}
    Line(l + k) = {p + k, p + (k + 1)%10};
  EndFor
  Curve Loop(v + 1) = {l : l + 9};
  Plane Surface(v + 1) = {v + 1};
  body() = Extrude {{0, 0, 1}, {0, 0, 0}, Pi/4} { Surface{v + 1}; };
  Cylinder(v + 20) = {bolts, 0, 0, 0, 0, 2*s*end, hole};
  flange() = BooleanDifference{ Volume{body(1)}; Delete; }{ Volume{v + 20}; Delete; };
  // the ring on the raised face that the gasket covers
  Disk(v + 30) = {0, 0, s*gap, outer};
  Disk(v + 31) = {0, 0, s*gap, inner};
  ring() = BooleanDifference{ Surface{v + 30}; Delete; }{ Surface{v + 31}; Delete; };
  cut() = BooleanIntersection{ Surface{ring()}; Delete; }{ Volume{flange()}; };
  BooleanFragments{ Volume{flange()}; Delete; }{ Surface{cut()}; Delete; }

  Cylinder(v + 40) = {bolts, 0, 0, 0, 0, s*back, shank, Pi};
  Cylinder(v + 41) = {bolts, 0, s*back, 0, 0, s*12, head, Pi};
  BooleanUnion{ Volume{v + 40}; Delete; }{ Volume{v + 41}; Delete; }
EndFor
