# a second reader, written from the specification alone, against archives and text: second.sh BUILD
. tests/cli/shared/begin.sh
needs python3 zstd
second() { python3 tests/second/spc_second.py "$@"; }

# every conformance archive has the status of the list, and every one is in the list
cd spec/conformance
sed -n 's/^| \([a-z]*\/[^ ]*\.spc\) | \([A-Z_]*\) |.*/\1: \2/p' README.md | sort >"$folder/wanted"
[ -s "$folder/wanted" ] || fail "spec/conformance/README.md lists no archive"
find good bad -name '*.spc' | sort >"$folder/there"
sed 's/:.*//' "$folder/wanted" | cmp -s - "$folder/there" ||
    fail "the list and the folder differ: $(sed 's/:.*//' "$folder/wanted" | diff - "$folder/there")"
# shellcheck disable=SC2046
python3 ../../tests/second/spc_second.py check $(cat "$folder/there") \
    >"$folder/said" 2>"$folder/err" || [ $? -eq 3 ] ||
    fail "the reader fails: $(cat "$folder/err")"
cd ../..
sed 's/^\([^:]*: [A-Z_]*\).*/\1/' "$folder/said" >"$folder/found"
cmp -s "$folder/wanted" "$folder/found" ||
    fail "not the statuses of the list: $(diff "$folder/wanted" "$folder/found")"

# the example in the specification is what the reader prints
second example spec/conformance/good/two-triangles.spc >"$folder/example" || fail "no example"
sed -n '/^## 12\. /,/^References /p' spec/spc-1.md | sed '$d' | sed '$d' >"$folder/text"
cmp -s "$folder/example" "$folder/text" ||
    fail "section 12 of the specification is not what 'spc_second.py example' prints: $(
        diff "$folder/text" "$folder/example" | head -n 10)"

# what the tools write today, both codecs, colours, several clusters and blocks
archive() { # NAME TRIANGLES SHAPE BUILD-OPTIONS...
    name=$1
    shape=$3
    "$tools/gen-scan" --triangles "$2" --shape "$shape" $color -o "$folder/$name.ply" 2>/dev/null
    shift 3
    "$tools/spc-build" -q "$@" "$folder/$name.ply" -o "$folder/$name.spc"
}
color=
archive raw 300 soup --codec raw --cluster-nodes 100 --block-nodes 30
archive zstd 700 sphere --cluster-nodes 300 --block-nodes 100
color=--color
archive colours 700 statue --cluster-nodes 300 --block-nodes 120
archive points 500 terrain --no-triangles --cluster-nodes 250 --block-nodes 80
second check "$folder/raw.spc" "$folder/zstd.spc" "$folder/colours.spc" "$folder/points.spc" \
    >"$folder/said" ||
    fail "the second reader refuses: $(grep -v ': OK$' "$folder/said")"
for name in raw zstd colours points; do
    clusters=$("$tools/spc-info" --json "$folder/$name.spc" |
        sed -n 's/^ *"clusters": \([0-9]*\),*$/\1/p' | head -n 1)
    [ "$clusters" -gt 2 ] || fail "$name.spc is too simple for this test"
done
second dump "$folder/raw.spc" >"$folder/dump"
grep -q '^cluster 2\.parent' "$folder/dump" || fail "the dump lacks a cluster"
[ "$(tail -n 1 "$folder/dump")" = end ] || fail "the dump has no end"
second hexdump "$folder/raw.spc" | grep -q '^# block 1: chunk header' || fail "the hexdump lacks a chunk"
