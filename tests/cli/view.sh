# spc-view with a user: keys, pointer, sizes, archives that are damaged before and meanwhile: view.sh BUILD
. tests/cli/shared/begin.sh
needs Xvfb xdotool python3
export LC_ALL=C
# the driver of the window's OpenGL is unloaded before leaks are counted: whose they are cannot be told then
export ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0"
server='' viewer=''
trap 'kill $viewer $server 2>/dev/null || true; wait; rm -rf "$folder"' EXIT
: >"$folder/display"
Xvfb -displayfd 3 -screen 0 800x600x24 3>"$folder/display" 2>"$folder/err" &
server=$!
for _ in $(seq 100); do
    [ -s "$folder/display" ] && break
    sleep 0.1
done
[ -s "$folder/display" ] || { echo "skipped: Xvfb does not start: $(cat "$folder/err")"; exit 0; }
DISPLAY=:$(cat "$folder/display")
export DISPLAY
unset WAYLAND_DISPLAY || true
case $tools in /*) spc_view=$tools/spc-view ;; *) spc_view=$PWD/$tools/spc-view ;; esac
png() { python3 tests/cli/shared/png.py "$@" || fail "see above"; }

csv=$folder/frames.csv
last() { # NAME: value of the last whole line; nothing before there is one
    awk -F, -v name="$1" 'NR == 1 { n = NF; for (i = 1; i <= NF; i++) if ($i == name) c = i }
        NR > 1 && NF == n { v = $c } END { print v }' "$csv"
}
await() { # NAME TEST VALUE: as of test, or "is" and "not" of words; up to 15 s
    for _ in $(seq 300); do
        value=$(last "$1")
        case $2 in
        is) [ "$value" != "$3" ] || return 0 ;;
        not) [ -z "$value" ] || [ "$value" = "$3" ] || return 0 ;;
        *) [ -z "$value" ] || ! [ "$value" "$2" "$3" ] || return 0 ;;
        esac
        kill -0 $viewer 2>/dev/null || fail "spc-view has ended: $(cat "$folder/said")"
        sleep 0.05
    done
    fail "$1 is never $2 $3, but $(last "$1"): $(cat "$folder/said")"
}
begin() { # OPTIONS FILES...: until the window is there
    rm -f "$csv"
    : >"$csv"
    (cd "$folder/shots" && exec timeout 100 "$spc_view" --size 320x240 --samples 1 --fps 0 --stats "$csv" "$@") \
        >"$folder/said" 2>&1 &
    viewer=$!
    await frame -ge 1
    pictures=0
    window=$(timeout 20 xdotool search --sync --onlyvisible --name 'spc-view$' | head -n 1)
    timeout 20 xdotool windowfocus --sync "$window"
}
user() { timeout 20 xdotool "$@"; }
quits() { # CODE: of a viewer that was told to end
    for _ in $(seq 300); do
        kill -0 $viewer 2>/dev/null || break
        sleep 0.05
    done
    ! kill -0 $viewer 2>/dev/null || fail "spc-view does not end: $(tail -n 2 "$csv")"
    got=0
    wait $viewer || got=$?
    viewer=
    [ $got -eq "$1" ] || fail "spc-view exits $got, not $1: $(cat "$folder/said")"
}
saved() { # FILE NAME: the picture, once it is whole, moved there
    for _ in $(seq 300); do
        [ "$(tail -c 8 "$folder/shots/$1" 2>/dev/null | head -c 4)" != IEND ] || break
        sleep 0.05
    done
    mv "$folder/shots/$1" "$folder/$2" || fail "no picture $1 is saved"
}
picture() { # NAME: what F12 saves
    pictures=$((pictures + 1))
    user key F12
    saved "spc-view-00$pictures.png" "$1"
}

mkdir "$folder/shots"
"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan.ply" -o "$folder/a.spc"
"$tools/gen-scan" --triangles 200000 --shape sphere -o "$folder/scan2.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/scan2.ply" -o "$folder/b.spc"

# the camera: what the window shows is what spc-render draws; keys, drags, the wheel, a copied camera
begin "$folder/a.spc"
await blocks_missing -eq 0
picture start.png
"$tools/spc-render" --size 320x240 "$folder/a.spc" -o "$folder/r.png"
cmp -s "$folder/start.png" "$folder/r.png" || fail "the first picture is another than spc-render's"
eye=$(last eye_x)
user key ctrl+c key Right
await eye_x not "$eye"
user mousemove --window "$window" 160 120
turned=$(last eye_x)
user mousedown 1 mousemove --window "$window" 180 130 mousemove --window "$window" 220 140 mouseup 1
await eye_x not "$turned"
near=$(last eye_z)
user click 4 click 4
await eye_z not "$near"
user key ctrl+v
await eye_x is "$eye"
await blocks_missing -eq 0
picture pasted.png
cmp -s "$folder/start.png" "$folder/pasted.png" || fail "the copied camera shows another picture"
user key v keydown w
await eye_z not "$near"
user keyup w key Escape     # ends the flight, not the session
user click --repeat 2 --delay 40 1

# what is drawn
user key Home key minus
await eps_px is 1.41421
user key plus
await eps_px is 1
await blocks_missing -eq 0
sleep 0.4                   # the way home is animated
picture home.png
user key c
picture paint.png
png differ 5 "$folder/home.png" "$folder/paint.png"
user key m
await triangles_drawn -eq 0
user key c key c key c key c key m key m
await triangles_drawn -gt 0
user key a key a key x key x key o key o key i key p key p key n key h key h
user key r                  # OpenGL, by the processor
await nodes_drawn is ''
user key Right key r
await nodes_drawn not ''
user windowsize --sync "$window" 200 150
frames=$(last frame)
user key Left
await frame -gt "$frames"
picture small.png
png size 200x150 "$folder/small.png"
for size in "1 1" "700 3" "2 500" "1 1" "33 44" "300 200"; do
    # shellcheck disable=SC2086
    user windowsize "$window" $size key Right
done
frames=$(last frame)
user windowsize --sync "$window" 240 180 key Left
await frame -gt "$frames"
echo mine >"$folder/shots/spc-view-00$((pictures + 1)).png"
user key ctrl+s
saved "spc-view-00$((pictures + 2)).png" other.png
[ "$(cat "$folder/shots/spc-view-00$((pictures + 1)).png")" = mine ] || fail "a picture was written over"
png size 240x180 "$folder/other.png"
user key Escape
quits 0
[ ! -s "$folder/said" ] || fail "it says $(cat "$folder/said")"
rm -f "$folder"/shots/*.png

# several archives, of which one is none: told of, the others are shown; escape takes the message away, then ends it
begin "$folder/a.spc" "$folder/scan.ply" "$folder/b.spc" "$folder/a.spc"
await blocks_missing -eq 0
grep -qE "^spc-view: '.*/scan.ply': the file does not begin like" "$folder/said" || fail "it says $(cat "$folder/said")"
[ "$(last nodes_total)" -gt 200000 ] || fail "not all archives are shown: $(last nodes_total) nodes"
frames=$(last frame)
user key Escape
await frame -gt "$frames"
user key q
quits 0

# nothing but what is no archive, cut short, or not there
head -c 50000 "$folder/a.spc" >"$folder/short.spc"
for file in "$folder/scan.ply" "$folder/short.spc" "$folder/none.spc" "$folder" /dev/null; do
    begin "$file"
    user key Right key F12 key n key f key r key Escape
    quits 0
    [ "$(wc -l <"$folder/said")" -eq 1 ] || fail "$file: it says $(cat "$folder/said")"
done

# no room for all of it: what is there is drawn, with smooth edges, and then it rests; it says so to a script, too
begin --eps 0.001 --memory 16M --samples 2 "$folder/b.spc" "$folder/b.spc" "$folder/b.spc" "$folder/b.spc"
await blocks_missing -gt 0
await samples -eq 2
sleep 0.5
frames=$(last frame)
sleep 1
[ "$(last frame)" -le $((frames + 1)) ] || fail "at rest $(($(last frame) - frames)) frames a second are drawn"
[ "$(last blocks_missing)" -gt "$(last blocks_hidden)" ] || fail "all of it fits into 16 MB"
user key q
quits 0

# what the clipboard holds is no camera: that is told
begin "$folder/a.spc"
await blocks_missing -eq 0
timeout 20 "$tools/window_probe" 15 "$folder/own.ppm" >"$folder/log" 2>&1 &
probe=$!
other=$(timeout 20 xdotool search --sync --onlyvisible --name '^window_probe$' | head -n 1)
timeout 20 xdotool windowfocus --sync "$other" key c
timeout 20 xdotool windowfocus --sync "$window"
sleep 0.5
frames=$(last frame)
user key ctrl+v
sleep 1
[ "$(last frame)" -gt "$frames" ] || fail "nothing is said of what is no camera"
timeout 20 xdotool windowfocus --sync "$other" key q
wait $probe || fail "the probe exits $?"
timeout 20 xdotool windowfocus --sync "$window"
user key q
quits 0

# keys of eps go on from one that is beyond their ends
begin --eps 1000 "$folder/a.spc"
user key minus
await eps_px is 1000
user key plus
await eps_px is 707.107
user key q
quits 0

# a damaged block: the rest is drawn
cp "$folder/a.spc" "$folder/bad.spc"
printf '\377\377' | dd of="$folder/bad.spc" bs=1 seek=$(($(wc -c <"$folder/a.spc") - 20000)) conv=notrunc 2>/dev/null
begin --eps 0.01 "$folder/bad.spc" "$folder/a.spc"
await blocks_failed -gt 0
await nodes_drawn -gt 0
eye=$(last eye_x)
user key Right
await eye_x not "$eye"
user key ctrl+q
quits 0

# cut short, or deleted, while it is open
cp "$folder/b.spc" "$folder/cut.spc"
begin --orbit 0,0,5000 --eps 0.3 "$folder/cut.spc"
truncate -s $(($(wc -c <"$folder/b.spc") / 2)) "$folder/cut.spc"
user key f
await blocks_failed -gt 0
user key Right key Up key F12
eye=$(last eye_x)
user key Right
await eye_x not "$eye"
user key Escape
quits 0
cp "$folder/b.spc" "$folder/gone.spc"
begin --orbit 0,0,5000 "$folder/gone.spc"
rm "$folder/gone.spc"
user key f
await triangles_drawn -gt 0
await blocks_missing -eq 0
user key q
quits 0

# ended while it loads: by a signal, and by the window manager
for way in signal close; do
    begin --eps 0.001 "$folder/b.spc" "$folder/b.spc" "$folder/b.spc"
    case $way in
    signal)
        kill -INT $viewer
        quits 130
        ;;
    close)
        timeout 20 python3 tests/cli/shared/close_window.py "$window"
        quits 0
        ;;
    esac
done

# a script in a window has the size it asks for
printf 'wait\nscreenshot %s/1.png\nresize 100 80\nwait\nscreenshot %s/2.png\n' "$folder" "$folder" >"$folder/run.txt"
expect 0 '' timeout 60 "$tools/spc-view" --samples 1 --size 320x240 --script "$folder/run.txt" "$folder/a.spc"
cmp -s "$folder/1.png" "$folder/start.png" || fail "a script shows another picture"
png size 100x80 "$folder/2.png"
expect 1 ".*cannot create the picture.*" \
    timeout 60 "$tools/spc-view" --size 32x24 --screenshot "$folder/no/no.png" "$folder/a.spc"
one_line
