// Bored pile, 15 m deep, 1 m wide: half a section, r to the right, z up.
// gmsh -2 -format msh2 pile.geo makes pile.msh.
Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;
fine = 0.25; shaft = 0.6; far = 4;
Point(1) = {0, -30, 0, far};   Point(2) = {25, -30, 0, far};
Point(3) = {25, -5, 0, far};   Point(4) = {25, 0, 0, far};
Point(5) = {0.5, 0, 0, shaft}; Point(6) = {0, 0, 0, shaft};
Point(7) = {0, -15, 0, fine};  Point(8) = {0.5, -15, 0, fine};
Point(9) = {0.5, -5, 0, shaft};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5};
Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 1}; Line(8) = {7, 8};
Line(9) = {8, 9}; Line(10) = {9, 5}; Line(11) = {9, 3};
Curve Loop(1) = {1, 2, -11, -9, -8, 7}; Plane Surface(1) = {1};
Curve Loop(2) = {11, 3, 4, -10};        Plane Surface(2) = {2};
Curve Loop(3) = {8, 9, 10, 5, 6};       Plane Surface(3) = {3};
Physical Surface("sand") = {1};
Physical Surface("clay") = {2};
Physical Surface("pile") = {3};
Physical Curve("axis") = {6, 7};
Physical Curve("far") = {2, 3};
Physical Curve("bottom") = {1};
Physical Curve("surface") = {4};
Physical Curve("head") = {5};
Physical Curve("shaft_clay") = {10};
Physical Curve("shaft_sand") = {9};
Physical Curve("base") = {8};
