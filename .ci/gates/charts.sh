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
    for table in work-precision failure cost growth heavy-top triangle scale water orbits racket torus; do
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
