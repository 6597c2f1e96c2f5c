#!/bin/sh
# Scans of points without faces, from file to archive: points.sh BUILD
. tests/cli/shared/begin.sh

# vertices FILE: those of the generated scan in FILE (ascii), as points
vertices() {
    awk '/^element vertex/ { n = $3 } /^element face/ { skip = 1 } skip && /^property/ { next }
        /^element face/ { next } /^end_header/ { print; body = 1; next }
        !body { print } body && n-- > 0 { print }' "$1"
}
# key NAME: a number of the JSON in $folder/out
key() { sed -n "s/^ *\"$1\": \([0-9a-z]*\),*$/\1/p" "$folder/out" | head -n 1; }

"$tools/gen-scan" --triangles 24000 --shape statue --color --format ascii -o "$folder/mesh.ply" 2>/dev/null
vertices "$folder/mesh.ply" >"$folder/statue.ply"
"$tools/gen-scan" --triangles 12000 --shape terrain --double --offset 500000,5400000,0 --format ascii \
    -o "$folder/mesh.ply" 2>/dev/null
vertices "$folder/mesh.ply" >"$folder/far.ply"
"$tools/gen-scan" --triangles 4000 --shape soup --format ascii -o "$folder/mesh.ply" 2>/dev/null
vertices "$folder/mesh.ply" >"$folder/soup.ply"     # a cube full of points, many of them two by two
awk '/^element vertex/ { $3 = 3 * $3 } { print } body { print $1, $2, $3, 255 - $4, $5, $6; print 0, 0, 0, 9, 9, 9 }
    /^end_header/ { body = 1 }' "$folder/statue.ply" >"$folder/often.ply"

for name in statue far soup often; do
    first=
    while read -r ways; do
        # shellcheck disable=SC2086
        "$tools/spc-build" -q $ways "$folder/$name.ply" -o "$folder/a.spc" --force ||
            fail "$name: spc-build $ways fails"
        sum=$(cksum <"$folder/a.spc")
        [ -n "$first" ] || first=$sum
        [ "$sum" = "$first" ] || fail "$name: other bytes with $ways"
    done <<END
--threads 1 --part-faces 1000000
--threads 4
--threads 2 --memory 64M
--part-faces 6000 --threads 4
--part-faces 700 --threads 1
--part-faces 60 --threads 2
--vertices-on-disk --threads 2 --part-faces 3000
END
    "$tools/spc-info" --verify=3 "$folder/a.spc" >/dev/null || fail "$name: not whole"
done

# doubles far from the origin have their digits
expect 0 '' "$tools/spc-build" -q "$folder/far.ply" -o "$folder/far.spc"
[ ! -s "$folder/err" ] || fail "a warning of doubles: $(cat "$folder/err")"

# counts: a leaf a point, but for those that are nowhere
sed 's/^element vertex .*/element vertex 6/; /^end_header/q' "$folder/statue.ply" >"$folder/six.ply"
printf '%s\n' '0 0 0 1 2 3' 'nan 0 0 1 2 3' '1 0 0 4 5 6' '0 inf 0 1 2 3' '0 1 0 7 8 9' '0 0 1 7 8 9' >>"$folder/six.ply"
expect 0 ".*dropped 2 points that are not finite.*" \
    "$tools/spc-build" "$folder/six.ply" -o "$folder/six.spc" --json
for pair in points_in=6 leaves=4 faces_in=0 non_finite=2 closed=false degenerate=0; do
    [ "$(key "${pair%=*}")" = "${pair#*=}" ] || fail "six points: ${pair%=*} is $(key "${pair%=*}")"
done
grep -q '"name": "estimate points"' "$folder/out" || fail "no phase of estimating"
grep -q ' 4 points, ' "$folder/err" || fail "the summary does not speak of points"
expect 0 '' "$tools/spc-info" --verify=3 "$folder/six.spc"
expect 0 '' "$tools/spc-info" "$folder/six.spc"
grep -q 'read       6 points = 4 leaves + 2 dropped' "$folder/out" || fail "spc-info does not speak of points"
expect 1 '.*2 points are not finite.*' "$tools/spc-build" "$folder/six.ply" -o "$folder/b.spc" --strict
expect 1 '.*points without normals.*' "$tools/spc-build" "$folder/six.ply" -o "$folder/b.spc" --cull back
expect 1 '.*' "$tools/spc-build" "$folder/six.spc" -o "$folder/b.spc"
one_line

# several clouds make one archive, clouds and meshes do not
expect 0 '' "$tools/spc-build" "$folder/six.ply" "$folder/statue.ply" -o "$folder/two.spc" --json
[ "$(key points_in)" -gt 6000 ] && [ "$(key faces_in)" = 0 ] || fail "two clouds are not one archive"
expect 0 '' "$tools/spc-info" --verify=3 "$folder/two.spc"
expect 1 ".*/mesh.ply': it holds faces, but those before hold points alone.*" \
    "$tools/spc-build" "$folder/six.ply" "$folder/mesh.ply" -o "$folder/b.spc"

# few points, and many in one place
for n in 0 1 2 3 40; do
    sed "s/^element vertex .*/element vertex $n/; /^end_header/q" "$folder/statue.ply" >"$folder/few.ply"
    awk "BEGIN { for (i = 0; i < $n; i++) print(i == 1 ? 1 : 0, i == 2 ? 1 : 0, 5, 1, 2, 3) }" >>"$folder/few.ply"
    if [ "$n" = 0 ]; then
        expect 1 '.*neither faces nor points.*' "$tools/spc-build" "$folder/few.ply" -o "$folder/few.spc"
        continue
    fi
    expect 0 '' "$tools/spc-build" -q "$folder/few.ply" -o "$folder/few.spc" --force
    expect 0 '' "$tools/spc-info" --verify=3 "$folder/few.spc"
    rm -f "$folder/few.png"
    expect 0 '' "$tools/spc-render" "$folder/few.spc" -o "$folder/few.png" --size 64x64
done

# a point without what the header promises behind it
head -c "$(($(wc -c <"$folder/far.ply") - 40))" "$folder/far.ply" >"$folder/cut.ply"
expect 1 '.*' "$tools/spc-build" "$folder/cut.ply" -o "$folder/b.spc"
[ ! -e "$folder/b.spc" ] || fail "a target of a scan that is cut short"
