# a window, what a user does in it and what it shows, on a screen that is memory: window.sh BUILD
. tests/cli/shared/begin.sh

# without a display: one line that says what to do instead
expect 1 'window_probe: no display: use spc-render or --script \(.*\)' \
    env -u DISPLAY -u WAYLAND_DISPLAY timeout 20 "$tools/window_probe" 1
one_line

needs Xvfb xdotool python3
# the driver of the window's OpenGL is unloaded before leaks are counted: whose they are cannot be told then
export ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0"
server= probe=
trap 'kill $probe $server 2>/dev/null || true; wait; rm -rf "$folder"' EXIT
mkdir "$folder/screen" && : >"$folder/display"
Xvfb -displayfd 3 -screen 0 640x480x24 -fbdir "$folder/screen" 3>"$folder/display" 2>"$folder/err" &
server=$!
for _ in $(seq 50); do
    [ -s "$folder/display" ] && break
    sleep 0.1
done
[ -s "$folder/display" ] || { echo "skipped: Xvfb does not start: $(cat "$folder/err")"; exit 0; }
DISPLAY=:$(cat "$folder/display")
export DISPLAY
unset WAYLAND_DISPLAY || true

log=$folder/log
begin() { # the probe, until its window shows the first picture
    from=1
    : >"$log"
    timeout 20 "$tools/window_probe" 15 "$folder/own.ppm" >"$log" 2>&1 &
    probe=$!
    await '^shown 400x300 '
    window=$(timeout 5 xdotool search --sync --onlyvisible --name '^window_probe$' | head -n 1)
    timeout 5 xdotool windowfocus --sync "$window"
}
seen() { sed -n "$1,\$p" "$log" | grep -cE "$2" || true; }
await() { # PATTERN: a line of the log since the last "from"
    for _ in $(seq 100); do
        [ "$(seen $from "$1")" -eq 0 ] || return 0
        sleep 0.05
    done
    fail "there is no '$1' in: $(sed -n "$from,\$p" "$log")"
}
user() { # xdotool's words: what follows is awaited from here on
    from=$(($(wc -l <"$log") + 1))
    timeout 5 xdotool "$@"
}
only() { # lines since the last "user" that the pattern matches whole, in order, one a line of stdin
    sed -n "$from,\$p" "$log" | grep -E "$1" >"$folder/lines" || true
    cat >"$folder/wanted"
    cmp -s "$folder/wanted" "$folder/lines" || fail "the events are: $(cat "$folder/lines"), not: $(cat "$folder/wanted")"
}

# keys: what the layout makes of them, the same one when it goes up
begin
user key a shift+a shift+slash ctrl+b alt+x 1 minus space F1 F11 Escape Left Prior Return
await '^up #1$'
only '^(key|up)' <<'END'
key a modifiers 0
up a
key a modifiers 1
up a
key ? modifiers 1
up ?
key b modifiers 2
up b
key x modifiers 4
up x
key 1 modifiers 0
up 1
key - modifiers 0
up -
key   modifiers 0
up  
key #13 modifiers 0
up #13
key #23 modifiers 0
up #23
key #0 modifiers 0
up #0
key #5 modifiers 0
up #5
key #9 modifiers 0
up #9
key #1 modifiers 0
up #1
END
user key c ctrl+v shift+Insert
await '^up c$'
for _ in $(seq 40); do
    [ "$(seen "$from" '^paste probe$')" -eq 2 ] && break
    sleep 0.05
done
only '^(key v|paste)' <<'END'
paste probe
paste probe
END

# buttons: a double click is two near each other in time and place
user mousemove --window "$window" 20 30 click 1 click 1 click 3 mousemove --window "$window" 60 30 click 1
await '^released 0 at 60 30'
only '^(button|released)' <<'END'
button 0 clicks 1 modifiers 0 at 20 30
released 0 at 20 30
button 0 clicks 2 modifiers 0 at 20 30
released 0 at 20 30
button 1 clicks 1 modifiers 0 at 20 30
released 1 at 20 30
button 0 clicks 1 modifiers 0 at 60 30
released 0 at 60 30
END
user keydown shift mousedown 2 mousemove --window "$window" 90 80 mousemove --window "$window" 120 100 mouseup 2 keyup shift
await '^released 2 at 120 100$'
[ "$(seen "$from" '^button 2 clicks 1 modifiers 1 at 60 30$')" -eq 1 ] || fail "no drag begins: $(cat "$log")"
[ "$(seen "$from" '^move 120 100 modifiers 1$')" -eq 1 ] || fail "the drag does not end: $(cat "$log")"
user click 4 click 5 click 4
await '^wheel 1 '
for _ in $(seq 40); do
    [ "$(seen "$from" '^wheel ')" -eq 3 ] && break
    sleep 0.05
done
only '^wheel' <<'END'
wheel 1 at 120 100
wheel -1 at 120 100
wheel 1 at 120 100
END

# sizes: the picture follows, full screen too, and a wait ends from another thread without having cost anything
user windowsize "$window" 310 250
await '^resize 310x250$'
await '^shown 310x250 '
user key f
await '^shown 640x480 '
user key f
await '^shown 310x250 '
user key w
await '^woken yes idle yes$'
user key q
await '^end as told$'
wait $probe || fail "the probe exits $?: $(tail -n 40 "$log")"
[ "$(grep -c '^shown .* wrong 0$' "$log")" -eq "$(grep -c '^shown' "$log")" ] || fail "wrong pixels: $(grep '^shown' "$log")"

# what reaches the screen is that, pixel by pixel; a window manager's wish to close is an event
begin
for _ in $(seq 40); do # swapped, but not yet drawn by the server
    python3 tests/cli/shared/screen.py "$folder/screen/Xvfb_screen0" && break
    sleep 0.05
done
cp "$folder/screen/Xvfb_screen0" "$folder/then"
user key q
await '^end as told$'
wait $probe || fail "the probe exits $?: $(tail -n 40 "$log")"
python3 tests/cli/shared/screen.py "$folder/then" "$folder/own.ppm" || fail "the screen shows another picture"
probe=
