#!/usr/bin/env bash
# OpenGeoSys 6.5.9 (ogs, PyPI): GMSH2OGS on a mesh of Gmsh 4.15.2 (PyPI) with two surfaces, physical tags 10 and 20, and two curves of
# two lines each, tags 5 and 15.
# A good guess: MaterialIDs are the tags, or count the surfaces from 0; lines that are left out (-e) do not count; format 4.1, which Gmsh has
# written by default since 2018, is read.
# Seen: MaterialIDs number all tags from 0 in their order, curves included: 10 and 20 become 1 and 3, with and without -e. With
# --gmsh2_physical_id, which its own warning asks for with format 2, they number the elementary entities: 0 and 1. Format 4.1 is refused.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install ogs==6.5.9 gmsh==4.15.2
cat >two.geo <<'GEO'
Point(1) = {0, 0, 0}; Point(2) = {2, 0, 0}; Point(3) = {2, 1, 0}; Point(4) = {0, 1, 0}; Point(5) = {1, 0, 0}; Point(6) = {1, 1, 0};
Line(1) = {1, 5}; Line(2) = {5, 2}; Line(3) = {2, 3}; Line(4) = {3, 6}; Line(5) = {6, 4}; Line(6) = {4, 1}; Line(7) = {5, 6};
Curve Loop(1) = {1, 7, 5, 6}; Plane Surface(1) = {1}; Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Physical Curve("base", 5) = {1, 2}; Physical Curve("top", 15) = {4, 5};
Physical Surface("clay", 10) = {1}; Physical Surface("sand", 20) = {2};
GEO
cat >mesh.py <<'PYTHON'
import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Mesh.MeshSizeMin", 1)
gmsh.option.setNumber("Mesh.MeshSizeMax", 1)
gmsh.open("two.geo")
gmsh.model.mesh.generate(2)
for version in (2.2, 4.1):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write(f"two_{version}.msh")
PYTHON
python/bin/python mesh.py
python/bin/GMSH2OGS --version | grep -i version
numbers() { # OPTION …: kind and MaterialIDs of the elements
  python/bin/GMSH2OGS -i two_2.2.msh -o two.vtu "$@" >/dev/null 2>&1
  # OpenGeoSys writes them as texts: number, MaterialID, kind, nodes.
  python/bin/VTK2OGS -i two.vtu -o two_ogs5.msh >/dev/null 2>&1
  sed -n '/ELEMENTS/,$p' two_ogs5.msh | awk 'NF > 3 { print $3, $2 }' | sort -u | paste -sd, -
}
ids=$(numbers) without=$(numbers -e) asked=$(numbers --gmsh2_physical_id)
code=0 && said=$(python/bin/GMSH2OGS -i two_4.1.msh -o two.vtu 2>&1) || code=$?
printf '%s\n' "lines 5 15, surfaces 10 20: $ids" "with -e: $without" "with --gmsh2_physical_id: $asked" "format 4.1: exit code $code" "$said"
[ "$ids" = "line 0,line 2,tri 1,tri 3" ] && [ "$without" = "tri 1,tri 3" ] && [ "$asked" = "line 0,line 1,line 2,line 3,tri 0,tri 1" ] &&
  [ "$code" -ne 0 ] && grep -q "Wrong gmsh file format version '4.1'" <<<"$said" && echo "as written" || { echo "CHANGED"; exit 1; }
