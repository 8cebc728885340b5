# The program of the charts, installed in $prefix.

# Every chart, quickly: tables with their header, pictures where gnuplot is there, and what is refused.
charts_draw() {
    local table
    "$bin/frb_charts" all --quick --out "$work/charts"
    "$bin/frb_charts" agreement --quick --out "$work/charts" | grep -E "^ +[0-9]+ of [0-9]+ ratios agree within 15 %$"
    [ "$(ls "$work/charts"/*.dat | wc -l)" -ge 25 ]
    for table in "$work/charts"/*.dat; do
        grep -q '^# columns: ' "$table"
        grep -vq '^#' "$table"
    done
    for table in work-precision failure cost growth heavy-top heavy-top-weak heavy-top-energy triangle scale water orbits racket torus tangent; do
        [ -s "$work/charts/$table.svg" ] || ! command -v gnuplot
    done
    # Pictures a browser can show: well-formed, those of the README and those just drawn.
    for table in data/charts/*.svg "$work/charts"/*.svg; do
        [ ! -e "$table" ] || python3 -c 'import sys, xml.dom.minidom as m; m.parse(sys.argv[1])' "$table"
    done
}

charts_refuse() {
    "$bin/frb_charts" | grep -q 'WHAT'
    refused 'no such chart: nonsense' "$bin/frb_charts" nonsense
    refused 'needs a folder' "$bin/frb_charts" --out
}

# A disk that fills while a chart is made, at a table, a script or a picture: the run ends with exit code 1 and one line
# on standard error, and what lies on the disk is whole.
charts_meet_a_full_disk() {
    local free file code
    for free in 0 4 100 160 176 200 300 400 600 720; do
        dd if=/dev/zero of=disk/filler bs=1k count=$((720 - free)) 2>/dev/null
        code=0
        "$bin/frb_charts" orbits --quick --out disk >charts.stdout 2>charts.stderr || code=$?
        cat charts.stderr
        [ $code = 1 ]
        [ "$(wc -l <charts.stderr)" = 1 ]
        rm disk/filler
        for file in $(ls -A disk); do cmp "disk/$file" "whole/$file"; done
        rm -f disk/*
    done
    # The limit of the shell, and a full standard output.
    code=0
    (ulimit -f 8; "$bin/frb_charts" orbits --quick --out limited >charts.stdout 2>charts.stderr) || code=$?
    [ $code = 1 ]
    [ "$(wc -l <charts.stderr)" = 1 ]
    [ -z "$(ls -A limited)" ]
    if "$bin/frb_charts" >/dev/full 2>/dev/null; then return 1; fi
}
charts_leave_no_part() {
    "$bin/frb_charts" orbits --quick --out whole
    with_small_disk 720 charts_meet_a_full_disk
}
