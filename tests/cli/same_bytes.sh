#!/bin/sh
# The bytes of an archive depend on the scan and on what shapes it, not on how it is built (I10):
# same_bytes.sh BUILD
. tests/cli/shared/begin.sh

# same NAME GENERATOR-OPTIONS...: one scan, built in many ways
same() {
    name=$1
    shift
    "$tools/gen-scan" "$@" -o "$folder/$name.ply" 2>/dev/null
    first=
    mkdir -p "$folder/elsewhere"
    while read -r ways; do
        # shellcheck disable=SC2086
        "$tools/spc-build" -q $ways "$folder/$name.ply" -o "$folder/a.spc" --force ||
            fail "$name: spc-build $ways fails"
        sum=$(cksum <"$folder/a.spc")
        [ -n "$first" ] || first=$sum
        [ "$sum" = "$first" ] || fail "$name: other bytes with $ways"
    done <<END
--threads 1 --memory 4G
--threads 2
--threads 8 --memory 64M
--temp $folder/elsewhere
--part-faces 700 --threads 3
--part-faces 40 --threads 2
--vertices-on-disk --threads 2
--slice-log2 9 --threads 2
--slice-log2 12 --threads 1 --part-faces 2000
END
    "$tools/spc-info" --verify=3 "$folder/a.spc" >/dev/null || fail "$name: not whole"
}

same statue --triangles 30000 --shape statue --color
same shuffled --triangles 30000 --shape terrain --shuffle
same far --triangles 20000 --shape terrain --double --offset 500000,5400000,0 --shuffle --color
same loose --triangles 15000 --shape soup --shuffle
