# Batches that nobody watches: hostile names, many scans, what stops them, what the last lines say: batch.sh BUILD
. tests/cli/shared/begin.sh
"$tools/gen-scan" --triangles 600 -o "$folder/a.ply" 2>/dev/null

# what a terminal would act on is in no line, of one archive or of many
mkdir "$folder/odd"
cp "$folder/a.ply" "$folder/odd/$(printf 'title\033]0;x\007').ply"
cp "$folder/a.ply" "$folder/odd/$(printf 'two\nlines').ply"
cp "$folder/a.ply" "$folder/odd/-dash ü.ply"
expect 0 '\[1/3\] .*/-dash ü.spc: 612 triangles, .*' "$tools/spc-build" "$folder/odd/" --out-dir "$folder/archives"
[ "$(wc -l <"$folder/err")" -eq 4 ] || fail "names break lines: $(cat "$folder/err")"
! grep -q "$(printf '[\033\007]')" "$folder/err" || fail "control characters of names are shown"
expect 0 '.*/two\?lines.spc: 612 triangles, .*' "$tools/spc-build" --force "$folder/a.ply" -o "$folder/archives/$(printf 'two\nlines').spc"

# the same scan twice; a stem that other scans share, whatever lies between them
expect 1 "  '.*/a.ply': its archive would be called '.*/a.ply.spc', as that of an earlier scan" \
    "$tools/spc-build" "$folder/a.ply" "$folder/a.ply" --out-dir "$folder/twice"
mkdir "$folder/names"
for name in b.ply a.ply a.stl a.b.ply aa.ply a.ply.ply; do cp "$folder/a.ply" "$folder/names/$name"; done
expect 1 "  '.*/a.ply.ply': its archive would be called '.*/a.ply.spc', as that of an earlier scan" \
    "$tools/spc-build" "$folder/names" --out-dir "$folder/named"
[ "$(cd "$folder/named" && echo *)" = "a.b.spc a.ply.spc a.stl.spc aa.spc b.spc" ] || fail "named: $(ls "$folder/named")"

# thousands of scans, nothing to do: names take no time (a second at most here, with hours for cubes)
mkdir "$folder/many" "$folder/done"
i=0
while [ $i -lt 3000 ]; do
    i=$((i + 1))
    echo "$folder/many/scan$i.ply"
done >"$folder/list"
sed 's|.*/|'"$folder"'/done/|; s|ply$|spc|' "$folder/list" | xargs touch -d '2002-01-01'
xargs touch -d '2001-01-01' <"$folder/list"
expect 0 '0 converted, 3000 up to date, 0 failed' \
    timeout 20 "$tools/spc-build" --update --list "$folder/list" --out-dir "$folder/done"

# a folder that is none, before anything is read; a pipe in a folder is not waited for
expect 1 "spc-build: '.*/a.ply': not a folder, so no archives can be put there" \
    "$tools/spc-build" "$folder/none.ply" --out-dir "$folder/a.ply"
one_line
mkdir "$folder/mixed" "$folder/mixed/sub.ply"
mkfifo "$folder/mixed/pipe.ply"
cp "$folder/a.ply" "$folder/mixed"
expect 0 '1 converted, 0 failed' timeout 20 "$tools/spc-build" "$folder/mixed" --out-dir "$folder/plain"

# a list from Windows; a folder in a list that cannot be used is told once
printf '\357\273\277%s\r\n' "$folder/a.ply" >"$folder/list"
expect 0 '' "$tools/spc-build" -q --list "$folder/list" -o "$folder/bom.spc"
printf '\357\273\277# scans\n%s\n' "$folder/a.ply" >"$folder/list"
expect 0 '' "$tools/spc-build" -q --force --list "$folder/list" -o "$folder/bom.spc"
mkdir "$folder/empty"
echo "$folder/empty" >"$folder/list"
expect 1 "spc-build: '.*/empty': no file in this folder is named .*" "$tools/spc-build" --list "$folder/list" -o "$folder/x.spc"
one_line

# standard input is '-', even where something is called so
mkdir "$folder/here" "$folder/here/-"
expect 0 '' sh -c "cd '$folder/here' && '$(cd "$tools" && pwd)/spc-build' -q - -o x.spc <'$folder/a.ply'"

# standard streams that are closed: no message goes into an archive or a temporary file
expect 0 '' sh -c "cat '$folder/a.ply' | '$tools/spc-build' --progress always - -o '$folder/closed.spc' >&- 2>&-"
"$tools/spc-info" --verify "$folder/closed.spc" >/dev/null || fail "messages in the archive"
expect 1 '.*standard output: Bad file descriptor' sh -c "'$tools/spc-build' --json '$folder/a.ply' -o '$folder/closed2.spc' >&-"
expect 1 "spc-build: '-': a device, not a scan" sh -c "'$tools/spc-build' - -o '$folder/closed3.spc' <&-"

# more scans than files may be open
expect 1 "spc-build: '.*/a.ply': cannot open: Too many open files; fewer scans at once, or a higher 'ulimit -n'" \
    sh -c "ulimit -n 12; '$tools/spc-build' $(printf "'$folder/a.ply' %.0s" 1 2 3 4 5 6 7 8 9 10 11 12) -o '$folder/x.spc'"

# stopped in the middle: what is done stays, the last lines count what was not begun
mkfifo "$folder/wait"
"$tools/spc-build" "$folder/none.ply" "$folder/a.ply" "$folder/wait" "$folder/odd" --out-dir "$folder/cut" 2>"$folder/err" &
child=$!
i=0
while [ ! -e "$folder/cut/a.spc" ] && [ $i -lt 500 ]; do i=$((i + 1)); sleep 0.02; done
sleep 0.1
kill -TERM $child
code=0
wait $child || code=$?
[ $code -eq 1 ] || fail "a batch that was stopped exits $code"
grep -q '^1 converted, 2 failed; stopped before the other 3:$' "$folder/err" || fail "stopped: $(cat "$folder/err")"
grep -q "^  '.*/wait': cancelled$" "$folder/err" || fail "stopped: $(cat "$folder/err")"
[ "$(cd "$folder/cut" && ls -A)" = "a.spc" ] || fail "a batch that was stopped leaves $(ls -A "$folder/cut")"

# of points the longest is estimating them: the whole's share that progress tells has it
awk 'BEGIN { print "ply\nformat ascii 1.0\nelement vertex 900\nproperty float x\nproperty float y\nproperty float z\nend_header"
    for (i = 0; i < 900; i++) print i % 30, int(i / 30), i * i % 7 / 10 }' >"$folder/cloud.ply"
expect 0 '.*"phase":"build parts of points","done":[0-9]*,"total":[0-9]*,"overall":0\.[5-9].*' \
    "$tools/spc-build" --progress json --threads 1 --part-faces 60 "$folder/cloud.ply" -o "$folder/cloud.spc"
grep '"phase":"build parts of points"' "$folder/err" | head -n 1 | grep -q '"overall":0\.[5-9]' || fail "progress: $(cat "$folder/err")"
grep '"phase":"estimate points"' "$folder/err" | head -n 1 | grep -q '"overall":0\.[0-6]' || fail "progress: $(cat "$folder/err")"

# open scans take memory: as many as --memory has room for, or the build says how much it takes
limit=$(ulimit -Hn)
if [ "$limit" = unlimited ] || [ "$limit" -gt 2100 ]; then
    i=0
    while [ $i -lt 2000 ]; do i=$((i + 1)); echo "$folder/a.ply"; done >"$folder/list"
    expect 1 ".*/x.spc': 2000 scans at once take at least [0-9]* MB of memory to build, --memory is 64 MB" \
        timeout 20 "$tools/spc-build" --memory 64M --list "$folder/list" -o "$folder/x.spc"
fi

# names in archives come from others: nothing of them acts on a terminal
expect 0 '' "$tools/spc-info" --verify "$folder/archives/$(printf 'title\033]0;x\007').spc"
expect 0 '' "$tools/spc-info" "$folder/archives/$(printf 'title\033]0;x\007').spc"
grep -q '^source     title?\]0;x?.ply (ply le): ' "$folder/out" || fail "source: $(cat "$folder/out")"
! grep -q "$(printf '[\033\007]')" "$folder/out" || fail "spc-info shows control characters of names"
