#!/bin/sh
# What one update costs by the language of the law, and what tangents by differences and by dual numbers
# cost: `host/benches/languages.sh` from the root of the repository. Nanoseconds of CPU time per point.
set -eu
at=$(mktemp -d)
trap 'rm -r "$at"' EXIT
cargo build --release --quiet -p pilum-coulomb-joint -p sensitive_joint
built=${CARGO_TARGET_DIR:-target}/release
own="-shared -fPIC -fvisibility=hidden -I abi/include"
foreign=models/foreign
cc -std=c11 -O2 -I abi/include host/benches/languages.c -o "$at/languages" -ldl
cc -std=c11 -O2 $own $foreign/coulomb_joint.c -o "$at/c.so" -lm
# The same law with its tangent by differences.
sed 's/^    carry(joint, point, end);$/    carry(joint, point, end);\
    if (tangent == PILUM_TANGENT_CONSISTENT) return pilum_differentiate(joint, point, update, 5e-5, end);/
s/coulomb_joint_c/joint_by_differences/' $foreign/coulomb_joint.c >"$at/differences.c"
cc -std=c11 -O2 $own "$at/differences.c" -o "$at/differences.so" -lm
for law in coulomb_joint cam_clay; do
  c++ -std=c++17 -O2 $own $foreign/$law.cpp -o "$at/$law.cpp.so"
  gfortran -O2 -frecursive -shared -fPIC -J "$at" abi/include/pilum_law.f90 $foreign/$law.f90 -o "$at/$law.f90.so"
done
# A slip of the joint, and a plastic strain of the clay.
joint="10 1e6 4e5 5 30 10 0 -- -50 0 -1e-5 2e-4"
clay="3 0.2 0.04 1.1 1 0 0.3 nan nan -- -100 -150 -120 10 -5 20 -2e-3 1e-4 2e-4 3e-4 0 1e-4"
printf '%-24s %8s %12s %8s\n' "ns per point" update with_tangent rates
"$at/languages" $built/libcoulomb_joint.so coulomb_joint $joint
"$at/languages" "$at/c.so" coulomb_joint_c $joint
"$at/languages" "$at/coulomb_joint.cpp.so" coulomb_joint_cpp $joint
"$at/languages" "$at/coulomb_joint.f90.so" coulomb_joint_fortran $joint
"$at/languages" "$at/differences.so" joint_by_differences $joint
"$at/languages" $built/libsensitive_joint.so sensitive_joint 10 1e6 4e5 0.5 5 30 10 -- -50 0 -1e-5 2e-4
"$at/languages" "$at/cam_clay.cpp.so" cam_clay_cpp $clay
"$at/languages" "$at/cam_clay.f90.so" cam_clay_fortran $clay
