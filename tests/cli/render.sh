# spc-render as a user meets it: render.sh BUILD
. tests/cli/shared/begin.sh
png_size() { # width and height from the header
    od -An -tu1 -j16 -N8 "$1" | awk '{ print $3 * 256 + $4 "x" $7 * 256 + $8 }'
}

"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan.ply" -o "$folder/a.spc"

expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/a.png" --size 200x150 --stats "$folder/a.json"
[ "$(png_size "$folder/a.png")" = 200x150 ] || fail "the picture is $(png_size "$folder/a.png")"
for key in nodes_drawn nodes_processed triangles_drawn clusters_total clusters_drawn culled frustum backface \
    range occlusion bytes_read frame_ms open_ms fallback_splats; do
    grep -q "\"$key\":" "$folder/a.json" || fail "the statistics lack $key"
done

# every mode, outline and camera gives a picture, and the same one twice
for options in "--mode points --renderer gl" "--mode triangles --renderer gl" "--mode points" "--mode triangles" "--splat fast --eps 4" "--orbit 30,20" "--orbit 0,90,5" \
    "--eye 1,2,3 --target 0,0,1 --up 0,0,1" "--background none" "--background ffffff" "--fov 90 --eps 0.1" \
    "--size 1x1" "--no-cull"; do
    # shellcheck disable=SC2086
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/b.png" --size 100x100 $options
    # shellcheck disable=SC2086
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/c.png" --size 100x100 $options
    cmp -s "$folder/b.png" "$folder/c.png" || fail "$options: two pictures differ"
done

# every renderer says its name; soft gives the same bytes whatever the number of threads
expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/b.png" --size 300x200 --renderer gl --stats "$folder/a.json"
grep -q '"renderer": ".*OpenGL' "$folder/a.json" || fail "gl is $(grep renderer "$folder/a.json")"
cp "$folder/a.json" "$folder/gl.json"
for options in "--renderer soft --threads 1" "--renderer soft --threads 5" "--renderer soft" "--renderer auto" ""; do
    # shellcheck disable=SC2086
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/c.png" --size 300x200 $options --stats "$folder/a.json"
    grep -q '"renderer": "soft' "$folder/a.json" || fail "'$options' is $(grep renderer "$folder/a.json")"
    for key in nodes_drawn nodes_processed triangles_drawn clusters_drawn bytes_read; do
        [ "$(grep "\"$key\":" "$folder/a.json")" = "$(grep "\"$key\":" "$folder/gl.json")" ] ||
            fail "'$options': $key is not that of gl"
    done
    [ ! -e "$folder/first.png" ] && cp "$folder/c.png" "$folder/first.png"
    cmp -s "$folder/first.png" "$folder/c.png" || fail "'$options': two pictures differ"
done
if cmp -s "$folder/first.png" "$folder/b.png"; then fail "gl and soft are one"; fi
for side in 65535x1 1x65535; do
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/c.png" --size $side
done
(ulimit -v 300000; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/no.png" --size 16384x16384) 2>"$folder/err" &&
    fail "16384 x 16384 in 300 MB"
grep -q '16384 x 16384.*: 1024 MB' "$folder/err" || fail "no memory gives: $(cat "$folder/err")"
(ulimit -v 900000; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/no.png" --size 10000x10000) 2>"$folder/err" &&
    fail "10000 x 10000 in 900 MB"
grep -q 'no memory to draw .*: 511 MB' "$folder/err" || fail "no memory gives: $(cat "$folder/err")"

# what fails says so in one line
expect 1 "spc-render: '.*/none.spc': cannot open.*" "$tools/spc-render" "$folder/none.spc" -o "$folder/d.png"
expect 3 "spc-render: '.*/scan.ply': the file does not begin like.*" "$tools/spc-render" "$folder/scan.ply" -o "$folder/d.png"
cp "$folder/a.spc" "$folder/bad.spc"
size=$(wc -c <"$folder/a.spc")  # the last block holds leaves, which a near view needs
printf '\377\377' | dd of="$folder/bad.spc" bs=1 seek=$((size - 20000)) conv=notrunc 2>/dev/null
expect 3 "spc-render: '.*/bad.spc': checksum of block [0-9]+ does not match.*" \
    "$tools/spc-render" "$folder/bad.spc" -o "$folder/d.png" --no-cull --eps 0.01
expect 1 "spc-render: '.*/no/d.png': cannot create the picture.*" "$tools/spc-render" "$folder/a.spc" -o "$folder/no/d.png"
[ ! -e "$folder/d.png" ] || fail "a picture was left behind"
"$tools/spc-build" -q --no-triangles "$folder/scan.ply" -o "$folder/points.spc"
expect 0 '' "$tools/spc-render" "$folder/points.spc" -o "$folder/d.png" --size 50x50
expect 1 ".*points only.*" "$tools/spc-render" "$folder/points.spc" -o "$folder/e.png" --mode triangles
if [ -e /dev/full ]; then # through a link: were it removed, the device would stay
    ln -s /dev/full "$folder/full.png"
    expect 1 ".*cannot write the picture.*No space.*" "$tools/spc-render" "$folder/a.spc" -o "$folder/full.png" --size 300x300
    [ -h "$folder/full.png" ] || fail "what is no plain file was removed"
fi
mkfifo "$folder/pipe.png" # its reader goes away before the picture is written
(exec 3<"$folder/pipe.png"; head -c 8 <&3 >/dev/null) &
got=0
(trap '' PIPE; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/pipe.png" --size 1000x1000 --background none) 2>"$folder/err" || got=$?
wait
[ $got -eq 1 ] || fail "a broken pipe gives exit $got: $(cat "$folder/err")"
[ -p "$folder/pipe.png" ] || fail "a pipe was removed"

# usage
cp "$folder/a.spc" "$folder/same.spc"
ln -s same.spc "$folder/same.png"
expect 2 '.*the archive itself.*' "$tools/spc-render" "$folder/same.spc" -o "$folder/same.png"
expect 2 '.*the archive itself.*' "$tools/spc-render" "$folder/same.spc" -o "$folder/e.png" --stats "$folder/same.spc"
cmp -s "$folder/a.spc" "$folder/same.spc" || fail "the archive was overwritten"
expect 2 '.*--eps takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eps 0
expect 2 '.*--size takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --size 0x5
expect 2 '.*--renderer does not know.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --renderer none
expect 2 '.*--threads takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --threads 0
expect 2 '.*--fov takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --fov 180
expect 2 '.*--eye and --target.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eye 1,1,1
expect 2 '.*looks along.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eye 0,1,0 --target 0,0,0
[ ! -e "$folder/e.png" ] || fail "a picture in spite of wrong usage"

# splats that cross the eye's plane outside of the picture cost little: points from inside a model
"$tools/gen-scan" --triangles 200000 --shape statue -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q --force "$folder/scan.ply" -o "$folder/a.spc"
frame_ms() {
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/b.png" --stats "$folder/a.json" \
        --eye 0,0,1 --target 1,0,1.2 --up 0,0,1 --mode "$1"
    sed -n 's/.*"frame_ms": \([0-9]*\).*/\1/p' "$folder/a.json"
}
points=$(frame_ms points)
triangles=$(frame_ms hybrid)
[ "$points" -lt $((10 * triangles + 500)) ] || fail "points take $points ms from inside, triangles $triangles"
