#!/bin/sh
# Holds PETSc's solutions against `auto`: usage: check.sh FOLDER SOLVE [64], the folder of assemble and interpolate
# and what `make` built. On 1, 2 and 4 processes the same cage, to 1e-9 of the diagonal of the bounding box; on 2 meshes of
# triangles and of polygons, and an open one. Prints a line each; exit status 1 if one is off.
# A third argument 64 is for a PETSc with 64-bit indices.
set -eu
programs=$(cd "$1" && pwd)
solve=$(cd "$(dirname "$2")" && pwd)/$(basename "$2")
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cd "$here"
# More processes than cores, one thread each, also for root.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 OMP_NUM_THREADS=1

# hold NAME PROCESSES INDEX MESH [FLAGS]: its cage by PETSc and by auto.
hold() {
    name=$1 processes=$2 index=$3
    shift 3
    "$programs/assemble" "$@" --quiet --format petsc --order curve --index "$index" --out system
    "$programs/interpolate" "$@" --quiet --tol 1e-11 -o auto.obj
    for p in $processes; do
        timeout 60 mpirun -n "$p" "$solve" -dir system -tol 1e-11 >"solve-$p.json"
        "$programs/interpolate" "$@" --quiet --tol 2e-11 --solution system/X.petsc -o petsc.obj
        rm system/X.petsc
        sed -n 's/^ *"diagonal": \([0-9.e-]*\),$/L \1/p' system/manifest.json >both
        grep '^v ' auto.obj >a
        grep '^v ' petsc.obj >b
        paste -d' ' a b >>both
        awk -v name="$name" -v p="$p" '
            $1 == "L" { l = $2; next }
            NF != 8 { wrong = 1 }
            { d = ($2 - $6)^2 + ($3 - $7)^2 + ($4 - $8)^2; if (d > most) most = d; n++ }
            END {
                off = sqrt(most) / l
                printf "%s, %d vertices, %d processes: %.1e of the diagonal from auto\n", name, n, p, off
                exit !(l > 0 && n > 0 && !wrong && off <= 1e-9)
            }' both
    done
}

index=32
[ "${3:-}" = 64 ] && index=64
hold "quads" "1 2 4" $index irregular-quad:20000 --scheme catmull-clark --noise 0.1
hold "triangles" 2 $index icosphere:4 --scheme loop --noise 0.1
hold "polygons" 2 $index irregular-poly:2000 --scheme catmull-clark --noise 0.1
# Boundaries are solved before: a ball without some of its faces and the vertices of these alone.
"$programs/interpolate" quad-sphere:4 --quiet -o ball.obj
awk '
    $1 == "v" { line[++n] = $0 }
    $1 == "f" && ++faces > 400 { face[++kept] = $0; for (i = 2; i <= NF; i++) used[$i] = 1 }
    END {
        for (v = 1; v <= n; v++) if (v in used) { place[v] = ++m; print line[v] }
        for (f = 1; f <= kept; f++) {
            corners = split(face[f], word, " ")
            printf "f"
            for (i = 2; i <= corners; i++) printf " %d", place[word[i]]
            print ""
        }
    }' ball.obj >open.obj
hold "open" 2 $index open.obj --scheme catmull-clark
