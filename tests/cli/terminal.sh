# progress is for terminals, and nothing of it stays: terminal.sh BUILD
. tests/cli/shared/begin.sh
needs python3
"$tools/gen-scan" --triangles 100000 --shape statue -o "$folder/scan.ply" 2>/dev/null

run() { # NAME TERM OPTION...: "-" is no terminal, but a pipe
    name=$1
    term=$2
    shift 2
    python3 tests/cli/shared/terminal.py "$term" "$folder/scan.ply" "$tools/spc-build" "$@" --threads 1 --force \
        "$folder/scan.ply" -o "$folder/$name.spc" >"$folder/$name.shown" 2>&1 || echo failed >>"$folder/$name.shown"
}
run terminal xterm &
run dumb dumb &
run pipe - &
run quiet xterm -q &
run narrow xterm:34 &
wait
for name in terminal dumb pipe quiet narrow; do
    drawn=$(sed -n 's/^progress: //p' "$folder/$name.shown")
    sed 1d "$folder/$name.shown" >"$folder/rest"
    case $name$drawn in
    dumb0 | pipe0 | terminal[1-9]* | quiet[1-9]* | narrow[1-9]*) ;;
    *) fail "progress: $name: $(cat "$folder/$name.shown")" ;;
    esac
    if [ $name = quiet ]; then
        [ -z "$(cat "$folder/rest")" ] || fail "this stays of the progress: $(cat "$folder/rest")"
        continue
    fi
    head -n 1 "$folder/rest" | grep -q "^$folder/$name.spc: .* triangles, " || fail "$name: $(cat "$folder/rest")"
    ! sed 1d "$folder/rest" | grep -qv '^  ' || fail "more than the summary: $name: $(cat "$folder/rest")"
done

# so is that of several pictures
for term in xterm -; do
    drawn=$(python3 tests/cli/shared/terminal.py $term "$folder/pipe.spc" "$tools/spc-render" --frames 60 --size 90x90 \
        "$folder/pipe.spc" -o "$folder/turn.png" 2>&1) || fail "frames: $drawn"
    case $term$drawn in
    "xtermprogress: "[1-9]* | "-progress: 0") ;;
    *) fail "progress of frames: $drawn" ;;
    esac
    case $drawn in *[!0-9]) fail "this stays of it: $drawn" ;; esac
done

# the other tools write no escape sequence at all
for command in "spc-info" "spc-info --clusters" "spc-info --histogram e" "spc-info --verify" "spc-info --help"; do
    # shellcheck disable=SC2086
    expect 0 '' "$tools/"$command "$folder/pipe.spc"
    ! grep -q "$(printf '\033')" "$folder/out" "$folder/err" || fail "$command writes escape sequences"
done
