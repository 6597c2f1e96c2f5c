# scripts/experiments, which measures the papers' findings, and the programs that count for it: experiments.sh BUILD
. tests/cli/shared/begin.sh
needs python3
ulimit -f 65536
unset SPC_DATA SIZES PARTS
export OUT="$folder/o"

# a part alone, one size: a row, as the build says it; nothing stays but the table and its plot
said=
command -v gnuplot >/dev/null || said='experiments: the plot is left out: there is no gnuplot'
expect 0 "$said" env PARTS=times SIZES=0.02 scripts/experiments "$tools"
grep -q '^## times$' "$OUT/tables.md" || fail "the part has no heading"
grep -q '^| triangles | CPU s | wall s ' "$folder/out" || fail "there is no table"
[ "$(grep -c '^20' "$OUT/times.csv")" = 1 ] || fail "times.csv is wrong"
[ -z "$(ls "$OUT" | grep -vE '^(tables\.md|times\.(csv|svg|png))$')" ] || fail "left in the folder: $(ls "$OUT")"

# wrong usage
expect 2 "experiments: no part is called 'x': .*" env PARTS="times x" scripts/experiments "$tools"
expect 2 'experiments: not a number: .*' env SIZES=many scripts/experiments "$tools"
expect 2 'experiments BUILD: .*' scripts/experiments

# what counts: each way leaves out some of what the one before left over; one cluster is one list
"$tools/gen-scan" --triangles 200000 --shape sphere -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q --cluster-nodes 4096 "$folder/scan.ply" -o "$folder/many.spc"
"$tools/spc-build" -q --cluster-nodes 524288 --block-nodes 65535 "$folder/scan.ply" -o "$folder/one.spc"
"$tools/bench-shares" "$folder/many.spc" "$folder/one.spc" >"$folder/shares"
"$tools/bench-frames" whole hybrid 2 "$folder/many.spc" >"$folder/hybrid"
"$tools/bench-frames" --no-cull whole triangles 2 "$folder/many.spc" >"$folder/triangles"
python3 - "$folder" <<'END_OF_PYTHON' || fail "bench-shares or bench-frames count wrong"
import csv, sys
rows = list(csv.DictReader(open(sys.argv[1] + "/shares")))
assert len(rows) == 16, len(rows)
for row in rows:
    n = {name: float(value) for name, value in row.items() if name not in ("archive", "from")}
    assert 0 < n["tested"] <= n["chosen"] <= n["prefix"] <= n["nodes"] and n["one_list"] <= n["nodes"], row
    assert n["cones"] <= n["kept"] <= n["groups"] <= n["behind"] <= n["prefix"] and n["wrong"] <= n["axis"], row
    assert (n["clusters"] == 1) == row["archive"].endswith("one.spc") and n["read"] <= n["stored"], row
    # the box of a cluster has room for radii that the model's has not
    if n["clusters"] == 1:
        assert n["one_list"] <= n["prefix"] <= 1.2 * n["one_list"], row
    if row["from"] == "whole" and n["eps_px"] == 1 and n["clusters"] > 1:
        assert 0.2 < n["groups"] / n["prefix"] and 0.45 < n["axis"] / n["prefix"] < 0.55, row
    if row["from"] == "whole" and n["eps_px"] == 8 and n["clusters"] > 1:
        assert n["prefix"] < 0.8 * n["one_list"], row
hybrid, triangles = (next(csv.DictReader(open(sys.argv[1] + name))) for name in ("/hybrid", "/triangles"))
assert float(triangles["triangles"]) >= 150000 and float(triangles["nodes"]) == 0, triangles
assert 0 < float(hybrid["nodes"]) + float(hybrid["triangles"]) <= float(hybrid["tested"]), hybrid
assert float(hybrid["frame_ms"]) >= float(hybrid["choose_ms"]) > 0 and float(hybrid["read"]) > 0, hybrid
END_OF_PYTHON
