# spc-view without a user: scripts, pictures, statistics, what is wrong usage: view_script.sh BUILD
. tests/cli/shared/begin.sh
export LC_ALL=C
needs python3
view() { timeout 60 "$tools/spc-view" --offscreen "$@"; }
png() { python3 tests/cli/shared/png.py "$@" || fail "see above"; }
column() { # NAME CSV: its values, a line a frame
    awk -F, -v name="$1" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == name) c = i } NR > 1 { print $c }' "$2"
}

"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan.ply" -o "$folder/a.spc"
"$tools/gen-scan" --triangles 8000 --shape sphere -o "$folder/scan2.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan2.ply" -o "$folder/b.spc"

# a screenshot is what spc-render draws, whatever the camera, with a line a frame and a summary
for options in "" "--orbit 30,20 --eps 3 --mode points" "--eye 1,1,2 --target 0,1,0 --splat fast" \
    "--fov 120 --background none" "--size 1x1" "--fov 179" "--eps 0.000001 --size 64x48"; do
    # shellcheck disable=SC2086
    expect 0 '' view --size 160x120 $options --samples 1 --screenshot "$folder/v.png" --stats "$folder/v.csv" --json \
        "$folder/a.spc"
    mv "$folder/out" "$folder/json"
    # shellcheck disable=SC2086
    expect 0 '' "$tools/spc-render" --size 160x120 $options "$folder/a.spc" -o "$folder/r.png"
    cmp -s "$folder/v.png" "$folder/r.png" || fail "'$options': spc-view saves another picture than spc-render draws"
done
python3 - "$folder/json" "$folder/v.csv" <<'PY' || fail "the summary is $(cat "$folder/json")"
import json, sys
summary = json.load(open(sys.argv[1]))
lines = open(sys.argv[2]).read().splitlines()
assert sorted(summary) == sorted(["renderer", "frames", "window_ms", "first_picture_ms", "first_picture_bytes",
                                  "whole_picture_ms", "whole_picture_bytes", "bytes_read"]), "other keys"
assert summary["renderer"].startswith("soft")
assert summary["frames"] == len(lines) - 1, "%d lines" % len(lines)
assert all(len(line.split(",")) == len(lines[0].split(",")) for line in lines), "ragged lines"
assert summary["window_ms"] >= 0
assert 0 < summary["first_picture_ms"] <= summary["whole_picture_ms"]
assert 0 < summary["first_picture_bytes"] <= summary["whole_picture_bytes"] <= summary["bytes_read"]
PY
sed -n '/COLUMNS/,/^\.El/s/^\.It Li //p' cmd/man/spc-view.1 | tr -d ' ' | tr , '\n' >"$folder/told"
head -n 1 "$folder/v.csv" | tr , '\n' >"$folder/columns"
cmp -s "$folder/told" "$folder/columns" || fail "the manual page has other columns than the file"

# every command; twice the same pictures
cat >"$folder/all.txt" <<SCRIPT
# a comment, and nothing

frames 2
wait
fit
orbit 30 20
orbit 30 20 5
turn 40 10 3
eye 3 1 2 target 0 1 0	up 0 1 0   # tabs and comments
path 3 eye 0 1 4 target 0 1 0
key v
key w shift 4
key v
key c
key f12 alt
key HASH
drag left 50 50 90 60 3
drag right 50 50 60 60 2 shift
drag middle 50 50 60 60 2
wheel 60 60 2
doubleclick 60 60
frames 20
resize 120 90
eps 2
mode points
splat fast
wait
screenshot FOLDER/one # 1.png
screenshot FOLDER/one#1.png
mode hybrid
splat exact
key c
open $folder/b.spc
wait
screenshot FOLDER/two.png
quit
screenshot $folder/never.png
SCRIPT
for run in 1 2; do
    mkdir "$folder/$run"
    sed "s|FOLDER|$folder/$run|" "$folder/all.txt" >"$folder/run.txt"
    expect 0 '' view --fps 0 --size 160x120 --script "$folder/run.txt" --stats "$folder/$run/csv" "$folder/a.spc"
done
for name in one one#1.png two.png; do
    cmp -s "$folder/1/$name" "$folder/2/$name" || fail "the second time $name is another picture"
    png size 120x90 "$folder/1/$name"
done
cmp -s "$folder/1/one" "$folder/1/one#1.png" || fail "nothing happened, and the pictures differ"
png differ 5 "$folder/1/one" "$folder/1/two.png"
[ ! -e "$folder/never.png" ] || fail "a line after quit is done"
[ "$(column eye_x "$folder/1/csv" | sort -u | wc -l)" -ge 15 ] || fail "the camera stays: $(column eye_x "$folder/1/csv")"
nodes=0
for archive in a b; do
    one=$("$tools/spc-info" --json "$folder/$archive.spc" | sed -n 's/^ *"nodes": \([0-9]*\),*/\1/p' | head -n 1)
    nodes=$((nodes + one))
done
[ "$(column nodes_total "$folder/1/csv" | tail -n 1)" -eq $nodes ] || fail "both archives together have $nodes nodes"
[ "$(column eps_px "$folder/1/csv" | tail -n 1)" = 2 ] || fail "eps is not the script's"

# smooth edges, unless they are not wanted; paint; the same archive several times
printf 'wait\nscreenshot %s/smooth.png\nkey a\nwait\nscreenshot %s/plain.png\nkey c\nwait\nscreenshot %s/paint.png\n' \
    "$folder" "$folder" "$folder" >"$folder/run.txt"
expect 0 '' view --size 160x120 --background none --samples 3 --script "$folder/run.txt" \
    "$folder/a.spc" "$folder/a.spc" "$folder/a.spc"
png smooth "$folder/smooth.png"
png covers "$folder/plain.png" "$folder/smooth.png"
png differ 5 "$folder/plain.png" "$folder/paint.png"
expect 0 '' "$tools/spc-render" --size 160x120 --background none "$folder/a.spc" -o "$folder/r.png"
cmp -s "$folder/plain.png" "$folder/r.png" || fail "an archive that is open three times looks another way"
expect 0 '' "$tools/spc-render" --size 160x120 --background none --samples 3 "$folder/a.spc" -o "$folder/r.png"
cmp -s "$folder/smooth.png" "$folder/r.png" || fail "spc-render --samples draws another picture"

# a wait ends with eps as it was asked for, drawn, whatever a movement came to; so does a screenshot
printf 'wait\nturn 90 0 20\nwait\n' >"$folder/turn.txt"
for samples in 1 2; do
    expect 0 '' view --size 300x300 --samples $samples --nodes 1000 --stats "$folder/v.csv" --script "$folder/turn.txt" \
        "$folder/a.spc" "$folder/b.spc"
    [ "$(column eps_px "$folder/v.csv" | sort -un | tail -n 1)" != 1 ] || fail "no frame of the movement is coarser"
    [ "$(column eps_px "$folder/v.csv" | tail -n 1)" = 1 ] || fail "it ends with eps $(column eps_px "$folder/v.csv" | tail -n 1)"
done
# nodes that OpenGL tests in the tiles of a large picture are counted once each tile
expect 0 '' view --size 2100x40 --samples 1 --fps 0 --renderer gl --screenshot "$folder/v.png" --stats "$folder/v.csv" \
    "$folder/a.spc"
[ "$(column nodes_processed "$folder/v.csv" | tail -n 1)" -le $((2 * $(column nodes_chosen "$folder/v.csv" | tail -n 1))) ] ||
    fail "in two tiles more is tested than twice what is chosen: $(column nodes_processed "$folder/v.csv" | tail -n 1)"

# memory for a part of what is wanted: coarser, within the budget, without holes
"$tools/gen-scan" --triangles 700000 --shape statue -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan.ply" -o "$folder/large.spc"
set -- --size 160x120 --orbit 20,10 --eps 0.001 --background none
expect 0 '' view "$@" --samples 1 --memory 16M --screenshot "$folder/v.png" --stats "$folder/v.csv" "$folder/large.spc"
column bytes_resident "$folder/v.csv" | awk '$1 > 16 * 1048576 { exit 1 } $1 > 8 * 1048576 { much = 1 } END { exit !much }' ||
    fail "in memory are, frame by frame: $(column bytes_resident "$folder/v.csv" | tr '\n' ' ')"
[ "$(column blocks_missing "$folder/v.csv" | tail -n 1)" -gt 0 ] || fail "all of it fits into 16 MB"
expect 0 '' "$tools/spc-render" "$@" "$folder/large.spc" -o "$folder/r.png"
png covers "$folder/r.png" "$folder/v.png"

# what is damaged is left out, what is no archive ends it
cp "$folder/a.spc" "$folder/bad.spc"
printf '\377\377' | dd of="$folder/bad.spc" bs=1 seek=$(($(wc -c <"$folder/a.spc") - 20000)) conv=notrunc 2>/dev/null
rm -f "$folder/v.png"
expect 3 "spc-view: '.*/bad.spc': checksum of block [0-9]+ does not match .*; what can be read is drawn" \
    view --size 99x99 --screenshot "$folder/v.png" --stats "$folder/v.csv" --eps 0.01 "$folder/bad.spc"
one_line
png size 99x99 "$folder/v.png"
printf 'wait\norbit 0 0 1e9\nwait\n' >"$folder/away.txt"        # and it stays known
expect 3 ".*/bad.spc': checksum.*" view --size 99x99 --eps 0.01 --script "$folder/away.txt" "$folder/a.spc" "$folder/bad.spc"
[ "$(column blocks_failed "$folder/v.csv" | tail -n 1)" -gt 0 ] || fail "no block is damaged"
expect 1 "spc-view: '.*/none.spc': cannot open.*" view --screenshot "$folder/no.png" "$folder/none.spc"
expect 3 "spc-view: '.*/scan.ply': the file does not begin like.*" view --screenshot "$folder/no.png" "$folder/scan.ply"
head -c 100000 "$folder/a.spc" >"$folder/short.spc"
expect 3 "spc-view: '.*/short.spc': .*" view --screenshot "$folder/no.png" "$folder/a.spc" "$folder/short.spc"
for file in "$folder" /dev/null; do
    expect 3 "spc-view: '$file': not a regular file" view --screenshot "$folder/no.png" "$file"
    one_line
done
# shellcheck disable=SC2046
expect 1 'spc-view: .*64 archives are open.*' view --screenshot "$folder/no.png" $(for _ in $(seq 65); do echo "$folder/b.spc"; done)

# a fault in the last line costs nothing: one line names it
says() { # CODE PATTERN SCRIPT: as printf takes it
    # shellcheck disable=SC2059
    printf "$3" >"$folder/run.txt"
    expect "$1" "spc-view: '[^']*': $2" view --size 64x64 --script "$folder/run.txt" "$folder/a.spc"
    one_line
}
says 1 "line 3: 'nonsense' .*" "screenshot $folder/no.png\nwait\nnonsense\n"
says 1 "line 1: 'frames' .*" 'frames\n'
says 1 "line 2: '0' .*" '\nframes 0'
says 1 "line 1: 'nan' .*" 'eps nan'
says 1 "line 1: 'x' is one word too many" 'fit x'
says 1 "line 1: '.*" '\033[31m red'
! grep -q "$(printf '\033')" "$folder/err" || fail "a terminal gets an escape sequence out of a script"
says 1 'cannot open.*' "open $folder/none.spc\nscreenshot $folder/no.png"
says 3 'the file does not begin like.*' "open $folder/scan.ply\nscreenshot $folder/no.png"
says 1 'an archive that is open cannot be written to' "screenshot $folder/a.spc"
says 1 'line 2: the camera looks along .*' 'wait\neye 1 2 3 target 1 2 3\nwait'
says 1 'line 1: the camera looks along .*' 'eye 0 1 0 target 0 0 0'
says 1 'line 1: the camera looks along .*' 'path 3 eye 0 5 0 target 0 1 0'
says 1 'cannot create the picture.*' "screenshot $folder/no/no.png"
expect 2 '.*are the same file.*' view --screenshot "$folder/same" --stats "$folder/./same" "$folder/a.spc"
expect 1 "spc-view: '.*none.txt': cannot open the script.*" view --script "$folder/none.txt" "$folder/a.spc"
expect 1 "spc-view: '.*': cannot read the script.*" view --script "$folder" "$folder/a.spc"
expect 1 "spc-view: '.*': line 1: .*" view --script "$folder/a.spc" "$folder/a.spc"
expect 0 '' view --script /dev/null "$folder/a.spc"
[ ! -e "$folder/no.png" ] || fail "a picture in spite of a fault"

# usage
for options in "" "--script $folder/run.txt" "--screenshot $folder/no.png"; do
    # shellcheck disable=SC2086
    expect 2 'spc-view: no archive is named.*' view $options
    one_line
done
expect 2 '.*--offscreen needs.*' view "$folder/a.spc"
expect 2 '.*--script takes a file.*' view --script - "$folder/a.spc"
for wrong in "nodes 999" "fps -1" "fps nan" "samples 0" "samples 9" "memory 15M" "memory x" "eps 0" "size 0x1" "fov 180" "threads 0" \
    "mode none" "renderer card" "up 1" "background red"; do
    # shellcheck disable=SC2086
    expect 2 "spc-view: --${wrong%% *} .*" view --screenshot "$folder/no.png" --$wrong "$folder/a.spc"
    one_line
done
expect 2 '.*--eye and --target go together.*' view --screenshot "$folder/no.png" --eye 1,1,1 "$folder/a.spc"
expect 2 '.*looks along.*' view --screenshot "$folder/no.png" --eye 0,1,0 --target 0,0,0 "$folder/a.spc"
expect 2 '.*cannot be written to.*' view --screenshot "$folder/a.spc" "$folder/a.spc"
expect 2 '.*cannot be written to.*' view --stats "$folder/a.spc" --screenshot "$folder/no.png" "$folder/a.spc"
expect 2 '.*cannot be written to.*' view --script "$folder/run.txt" --stats "$folder/run.txt" "$folder/a.spc"
expect 2 '.*--help takes all.*' view --help=some
expect 1 '.*cannot write the statistics.*' view --screenshot "$folder/v.png" --stats "$folder/no/v.csv" "$folder/a.spc"
[ ! -e /dev/full ] ||
    expect 1 '.*cannot write the statistics.*' view --size 9x9 --screenshot "$folder/v.png" --stats /dev/full "$folder/a.spc"
[ ! -e "$folder/no.png" ] || fail "a picture in spite of wrong usage"
