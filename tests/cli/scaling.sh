# scripts/scaling, which measures what a build costs as scans grow: scaling.sh BUILD
. tests/cli/shared/begin.sh
needs python3
ulimit -f 65536                     # what does not fit must not fill the disk either
unset SCALING ROUNDS MEMORY CGROUP
export OUT="$folder/o" BANDWIDTH="$folder/machine"
echo '{"cores": 2, "copy_1": 1e9, "copy_all": 1e9, "disk_write": 1e6, "disk_read": 4e6}' >"$BANDWIDTH"
# an interpreter that needs no PATH, for there is none where gnuplot shall be missing
python=$(python3 -c 'import sys; print(sys.executable)')

# fractions of a million, a size that fits on no disk, no gnuplot
expect 0 'scaling: the plot is left out: there is no gnuplot' \
    env PATH="$folder" "$python" scripts/scaling "$tools" 1e9 0.02
cp "$folder/out" "$folder/table"
grep -q '1e+09 M left out: it may take .* of disk' "$folder/err" || fail "what does not fit is not named"
[ "$(ls "$OUT")" = scaling.csv ] || fail "left in the folder: $(ls "$OUT")"

# the same build by hand; only times differ from run to run
"$tools/gen-scan" --triangles 20000 --shape statue --shuffle -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q --json --memory 512M "$folder/scan.ply" -o "$folder/a.spc" >"$folder/run.json"
"$python" - "$OUT/scaling.csv" "$folder" <<'END' || fail "scaling.csv is wrong"
import csv, json, os, sys
rows = list(csv.DictReader(open(sys.argv[1])))
run = json.load(open(sys.argv[2] + "/run.json"))
assert [(row["millions"], row["order"]) for row in rows] == [("0.02", "in order"), ("0.02", "shuffled")], rows
row = {name: value if name == "order" else float(value or "nan") for name, value in rows[1].items()}
same = {"triangles": run["faces_in"], "output_bytes": run["file_bytes"], "memory_bytes": run["memory_bytes"],
        "temp_written_bytes": run["temp_written_bytes"], "temp_read_bytes": run["temp_read_bytes"],
        "scan_bytes": os.path.getsize(sys.argv[2] + "/scan.ply"), "rounds": 3, "cores": 2}
assert {name: row[name] for name in same} == same, (row, same)
phases = [phase["name"].replace(" ", "_") + "_cpu_s" for phase in run["phases"]]
assert list(row)[-len(phases) - 1:] == phases + ["other_cpu_s"], list(row)
total = sum(row[phase] for phase in phases)
# outside of the phases a program starts and ends; times have six decimals
assert abs(total + row["other_cpu_s"] - row["cpu_s"]) < 1e-5, row
assert -1e-3 < row["other_cpu_s"] < 0.1 + total / 10 and total > 1e-3, row
written = (row["temp_written_bytes"] + row["output_bytes"]) / 1e6
read = (row["temp_read_bytes"] + row["scan_bytes"]) / 4e6
assert abs(row["bound_s"] - written - read) < 1e-5, row
assert abs(row["wall_of_bound"] - row["wall_s"] / (written + read)) < 1e-4, row
END
heads=$(sed -n 's/^| triangles | //p' "$folder/table")
for head in 'CPU s' 'wall s' 'peak MB' 'temp GB written' 'archive MB' 'read vertices' 'build parts'; do
    case $heads in *"| $head |"*) ;; *) fail "the table lacks '$head'" ;; esac
done
grep -qE '^0\.02 M shuffled: wall .* at least .* times the bound$' "$folder/table" || fail "the bound is not printed"

# the plot, and the largest against the smallest; wrong usage
if command -v gnuplot >/dev/null; then
    expect 0 '.*plot are in .*' env ROUNDS=1 SCALING="0.002 0.004" "$python" scripts/scaling "$tools"
    grep -q '^0.004 M against 0.002 M, shuffled: ' "$folder/out" || fail "growth is not printed"
    [ -s "$OUT/scaling.png" ] && grep -q 'write archive' "$OUT/scaling.svg" || fail "there is no plot"
fi
expect 2 'scaling: not a number: .*' "$python" scripts/scaling "$tools" many
