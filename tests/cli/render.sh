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
case $tools in      # sanitizers need addresses of their own
*asan | *tsan) ;;
*)
    (ulimit -v 300000; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/no.png" --size 16384x16384) 2>"$folder/err" &&
        fail "16384 x 16384 in 300 MB"
    grep -q '16384 x 16384.*: 1024 MB' "$folder/err" || fail "no memory gives: $(cat "$folder/err")"
    (ulimit -v 900000; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/no.png" --size 10000x10000) 2>"$folder/err" &&
        fail "10000 x 10000 in 900 MB"
    grep -q 'no memory to draw .*: 512 MB' "$folder/err" || fail "no memory gives: $(cat "$folder/err")"
    ;;
esac

# what fails says so in one line
mkfifo "$folder/pipe.spc"
expect 3 "spc-render: '.*/pipe.spc': not a regular file" timeout 20 "$tools/spc-render" "$folder/pipe.spc" -o "$folder/d.png"
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
# a file has its name once it is whole: where there is no room for it what was there stays, and nothing beside it
mkdir "$folder/whole"
cp "$folder/a.spc" "$folder/whole/there.png"
ln -s there.png "$folder/whole/link.png"
for name in there.png link.png new.png; do
    got=0
    (ulimit -f 16; exec "$tools/spc-render" "$folder/a.spc" -o "$folder/whole/$name" --size 600x600) 2>"$folder/err" || got=$?
    [ $got -eq 1 ] || fail "a file that may not grow gives exit $got"
    grep -q "cannot write the picture: File too large$" "$folder/err" || fail "it says $(cat "$folder/err")"
    cmp -s "$folder/a.spc" "$folder/whole/there.png" || fail "the old picture is lost"
done
[ "$(ls -A "$folder/whole" | tr '\n' ' ')" = "link.png there.png " ] || fail "this is left: $(ls -A "$folder/whole")"
chmod 640 "$folder/whole/there.png"
expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/whole/link.png" --size 9x9 --stats "$folder/whole/s.json"
[ "$(png_size "$folder/whole/there.png")" = 9x9 ] && [ -h "$folder/whole/link.png" ] || fail "a link was not followed"
ls -l "$folder/whole/there.png" | grep -q '^-rw-r-----' || fail "the file's rights are others now"
[ "$(ls -A "$folder/whole" | tr '\n' ' ')" = "link.png s.json there.png " ] || fail "this is left: $(ls -A "$folder/whole")"
expect 1 ".*/no/s.json': cannot create the statistics: No such file or directory" \
    "$tools/spc-render" "$folder/a.spc" -o "$folder/b.png" --size 9x9 --stats "$folder/no/s.json"
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
for stats in "$folder/e.png" "$folder/./e.png" "$folder/../${folder##*/}/e.png"; do
    expect 2 '.*are the same file.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --stats "$stats"
done
expect 2 '.*are the same file.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --frames 2 --size 9x9 \
    --stats "$folder/e0001.png"
expect 0 '' "$tools/spc-render" "$folder/a.spc" -o /dev/null --stats /dev/null --size 9x9
expect 2 '.*--eps takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eps 0
expect 2 '.*--size takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --size 0x5
expect 2 '.*--renderer does not know.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --renderer none
expect 2 '.*--threads takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --threads 0
expect 2 '.*--fov takes.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --fov 180
expect 2 '.*--eye and --target.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eye 1,1,1
expect 2 '.*looks along.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" --eye 0,1,0 --target 0,0,0
[ ! -e "$folder/e.png" ] || fail "a picture in spite of wrong usage"

# several pictures: around the model, the first of them the plain one; six sides; samples
if command -v python3 >/dev/null; then
    png() { python3 tests/cli/shared/png.py "$@" || fail "see above"; }
    set -- --size 90x60 --eps 2
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/f.png" "$@"
    mkdir "$folder/turn.dir"
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/turn.dir/t.png" "$@" --frames 3 --stats "$folder/three.json"
    [ "$(cd "$folder/turn.dir" && echo *)" = "t0001.png t0002.png t0003.png" ] || fail "files: $(ls "$folder/turn.dir")"
    cmp -s "$folder/f.png" "$folder/turn.dir/t0001.png" || fail "the first picture of a turn is not the plain one"
    png differ 5 "$folder/turn.dir/t0001.png" "$folder/turn.dir/t0002.png"
    png differ 5 "$folder/turn.dir/t0002.png" "$folder/turn.dir/t0003.png"
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/r.png" "$@" --orbit 60,0
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/turn.dir/noend" "$@" --frames 3 --turn 180 --memory 16M
    cmp -s "$folder/r.png" "$folder/turn.dir/noend0002" || fail "the second of three within 180 degrees is not at 60"
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/turn.dir/minus.png" "$@" --frames 2 --turn -600 --orbit 360,0
    cmp -s "$folder/r.png" "$folder/turn.dir/minus0002.png" || fail "a turn to the left is another one"
    python3 - "$folder/three.json" <<'PY' || fail "the statistics are $(cat "$folder/three.json")"
import json, sys
pictures = json.load(open(sys.argv[1]))["pictures"]
assert len(pictures) == 3 and all(p["nodes_processed"] > 0 and "open_ms" in p for p in pictures)
assert pictures[0]["bytes_read"] > 0 and pictures[1]["bytes_read"] < pictures[0]["bytes_read"] / 2, "read again"
PY
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/six.png" "$@" --views 6 --stats "$folder/six.json"
    [ "$(png_size "$folder/six.png")" = 270x120 ] || fail "six views are $(png_size "$folder/six.png")"
    [ "$(grep -c '"nodes_drawn"' "$folder/six.json")" -eq 6 ] || fail "the statistics of six are $(cat "$folder/six.json")"
    tile=0
    for angles in 0,0 90,0 180,0 270,0 0,90 0,-90; do
        expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/r.png" "$@" --orbit=$angles
        png tile $((tile % 3)) $((tile / 3)) "$folder/r.png" "$folder/six.png"
        tile=$((tile + 1))
    done
    for gl in "" "--renderer gl"; do
        # shellcheck disable=SC2086
        expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/r.png" "$@" --background none $gl
        # shellcheck disable=SC2086
        expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/s.png" "$@" --background none --samples 2 $gl
        png smooth "$folder/s.png"
        ! python3 tests/cli/shared/png.py smooth "$folder/r.png" >/dev/null || fail "one sample a pixel has smooth edges"
    done
    expect 0 '' "$tools/spc-render" "$folder/a.spc" -o "$folder/s.png" "$@" --samples 2
    png differ 1 "$folder/f.png" "$folder/s.png"
fi
cp "$folder/a.spc" "$folder/x0002.spc"
expect 2 '.*the archive itself.*' "$tools/spc-render" "$folder/x0002.spc" -o "$folder/x.spc" --size 9x9 --frames 2
cmp -s "$folder/a.spc" "$folder/x0002.spc" || fail "the archive was overwritten"
expect 1 '.*cannot create the picture.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/no/e.png" --size 9x9 --frames 2
one_line
for wrong in "--frames 2 --views 6" "--frames 2 --eye 1,1,1 --target 0,0,0" "--views 6 --eye 1,1,1 --target 0,0,0" "--frames 0" \
    "--frames 100000" "--views 5" "--turn x --frames 2" "--turn 90" "--samples 0" "--samples 9" "--samples 2 --size 40000x9" \
    "--memory 15M" "--help=some"; do
    # shellcheck disable=SC2086
    expect 2 'spc-render: .*--.*' "$tools/spc-render" "$folder/a.spc" -o "$folder/e.png" $wrong
    one_line
done
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
