# spc-info --recover as a user meets it: recover.sh BUILD
. tests/cli/shared/begin.sh
# recover CODE FILE OPTION...: exit code; what it builds is whole
recover() {
    code=$1
    file=$2
    shift 2
    got=0
    "$tools/spc-info" "$folder/$file" --recover "$folder/out.spc" "$@" >"$folder/out" 2>"$folder/err" || got=$?
    [ $got -eq "$code" ] || fail "$file $* exits $got, not $code: $(cat "$folder/err" "$folder/out")"
    [ ! -e "$folder/out.spc" ] || "$tools/spc-info" --verify "$folder/out.spc" >/dev/null || fail "$file: not whole"
}
says() { grep -qE "^$1\$" "$folder/out" || fail "should say '$1', says: $(cat "$folder/out")"; }
complains() {
    grep -qE "^$1\$" "$folder/err" || fail "should complain '$1', says: $(cat "$folder/err")"
    [ "$(wc -l <"$folder/err")" -eq 1 ] || fail "more than one line: $(cat "$folder/err")"
    [ ! -s "$folder/out" ] || fail "half an answer: $(cat "$folder/out")"
}
fact() { "$tools/spc-info" --json "$1" | sed -n "s/^ *\"$2\": \"*\([^\",]*\)\"*,*\$/\1/p" | head -n 1; }
spoil() { printf '\125\252\125' | dd of="$folder/$1" bs=1 seek="$2" conv=notrunc 2>/dev/null; }
build() { "$tools/spc-build" -q --force --cluster-nodes 2000 --block-nodes 500 "$@"; }

"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
build --codec zstd:3 "$folder/scan.ply" -o "$folder/a.spc"
triangles=$(fact "$folder/a.spc" triangles)
size=$(wc -c <"$folder/a.spc")

# nothing is wrong: the same triangles and options, and what they came from
recover 0 a.spc
says "head       whole"
says ".*/out.spc: .* triangles, .*; nothing is lost"
[ "$(fact "$folder/out.spc" triangles)" = "$triangles" ] || fail "triangles are lost"
for key in codec closed normal_clusters error_kind colors vertex_exp name faces level cluster_nodes block_nodes; do
    [ "$(fact "$folder/out.spc" $key)" = "$(fact "$folder/a.spc" $key)" ] || fail "$key is another"
done
"$tools/spc-info" --json "$folder/out.spc" | grep -q '"codec": "zstd:3"' || fail "the level is another"
recover 1 a.spc
complains "spc-info: '.*/out.spc': the target exists; --force replaces it"
cp "$folder/out.spc" "$folder/first.spc"
recover 0 a.spc --force
cmp -s "$folder/first.spc" "$folder/out.spc" || fail "not the same bytes again"

# options that are not the defaults come along
build --codec raw --error paper --cull none --normal-clusters 9 "$folder/scan.ply" -o "$folder/b.spc"
recover 0 b.spc --force
for key in codec closed normal_clusters error_kind; do
    [ "$(fact "$folder/out.spc" $key)" = "$(fact "$folder/b.spc" $key)" ] || fail "$key is another"
done

# a block is lost: how much, and where
"$tools/spc-info" --blocks 5 "$folder/a.spc" >"$folder/blocks"
row=$(awk '$2 == "leaf" { print $4, $7; exit }' "$folder/blocks")
leaves=${row#* }
cp "$folder/a.spc" "$folder/bad.spc"
spoil bad.spc $((${row% *} + 200))
recover 1 bad.spc --force
says "blocks     .*, 1 damaged or missing"
says "lost       $leaves of [0-9 ]+ triangles of cluster 5, inside [-0-9. e]+"
says ".*; with loss"
[ "$(grep -c '^lost' "$folder/out")" -eq 1 ] || fail "more than one cluster is lost"
[ "$(fact "$folder/out.spc" triangles)" -eq $((triangles - leaves)) ] || fail "not the rest"
[ "$(fact "$folder/out.spc" closed)" = false ] || fail "a surface with holes is closed"
[ "$(fact "$folder/out.spc" name)" = scan.ply ] || fail "the source is forgotten"
recover 1 bad.spc --force --json
! command -v python3 >/dev/null || python3 -m json.tool <"$folder/out" >/dev/null || fail "no JSON"
grep -q "\"recovered\": $((triangles - leaves))," "$folder/out" || fail "JSON tells another number"
grep -q '"all": false' "$folder/out" || fail "JSON tells of no loss"

# without metadata, without a directory, without a head
cp "$folder/a.spc" "$folder/bad.spc"
spoil bad.spc $(($(fact "$folder/a.spc" head_bytes) - 20))
recover 1 bad.spc --force
says "metadata   lost: .*"
says ".*; no triangle is lost"
[ "$(fact "$folder/out.spc" name)" = bad.spc ] || fail "a source from nowhere"
cp "$folder/a.spc" "$folder/bad.spc"
spoil bad.spc 2000
recover 0 bad.spc --force
says "head       damaged: checksum of the cluster directory does not match"
says ".*; nothing is lost"
dd if=/dev/zero of="$folder/bad.spc" bs=4096 count=1 conv=notrunc 2>/dev/null
recover 1 bad.spc --force
says "triangles  .* recovered, of an unknown number"
says ".*; whether triangles are lost is not known"
[ "$(fact "$folder/out.spc" triangles)" = "$triangles" ] || fail "triangles are lost with the head"
grep -q '^lost' "$folder/out" && fail "a place of no loss"

# cut short: lines are bounded
head -c $((size / 5)) "$folder/a.spc" >"$folder/cut.spc"
recover 1 cut.spc --force
says "head       damaged: the file ends at byte $((size / 5)) of $size"
says "lost       triangles of [0-9]+ more clusters"
[ "$(wc -l <"$folder/out")" -le 24 ] || fail "too many lines"

# nothing to recover: exit 3, one line, the old target stays
cp "$folder/out.spc" "$folder/keep.spc"
recover 3 scan.ply --force
complains "spc-info: '.*/scan.ply': nothing in it is a whole block of an .spc archive"
: >"$folder/empty.spc"
recover 3 empty.spc --force
complains "spc-info: '.*/empty.spc': the file is empty"
build --no-triangles "$folder/scan.ply" -o "$folder/points.spc"
recover 3 points.spc --force
complains "spc-info: '.*/points.spc': the archive holds points only.*"
cmp -s "$folder/keep.spc" "$folder/out.spc" || fail "the old archive was touched"
recover 1 none.spc
complains "spc-info: '.*/none.spc': cannot open.*"
ln "$folder/a.spc" "$folder/self.spc"
got=0
"$tools/spc-info" "$folder/a.spc" --force --recover "$folder/self.spc" 2>"$folder/err" || got=$?
[ $got -eq 1 ] && grep -q 'the target is the archive itself' "$folder/err" || fail "an archive replaces itself"
left=$(find "$folder" -name '*.part')
[ -z "$left" ] || fail "left behind: $left"

# usage
for wrong in --force "--recover out.spc --clusters" "--recover out.spc --verify" --recover; do
    got=0
    # shellcheck disable=SC2086
    "$tools/spc-info" "$folder/a.spc" $wrong >"$folder/out" 2>"$folder/err" || got=$?
    [ $got -eq 2 ] || fail "$wrong exits $got, not 2"
done
