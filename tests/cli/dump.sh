# The C library and the second reader decode every good archive to the same nodes: dump.sh BUILD
. tests/cli/shared/begin.sh
needs python3 zstd
compared=0
for file in spec/conformance/good/*.spc; do
    "$tools/conformance_dump" "$file" >"$folder/c"
    python3 tests/second/spc_second.py dump "$file" >"$folder/all"
    grep -E '^(node|triangle|end|block [0-9]+ (group|vertex_base) )' "$folder/all" >"$folder/python"
    if ! cmp -s "$folder/c" "$folder/python"; then
        echo "$file is read in two ways:"
        diff "$folder/c" "$folder/python" | head -n 6
        exit 1
    fi
    compared=$((compared + $(wc -l <"$folder/c")))
done
[ $compared -gt 3000 ] || fail "only $compared lines were compared"
