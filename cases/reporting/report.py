"""Writes report.html: one file that needs nothing else, pictures inside it as data."""

from __future__ import annotations

import base64
import html
import io
import os
import tomllib
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

from launching.report_keys import read_report_keys  # noqa: E402
from launching.summary import number  # noqa: E402
from reporting.curves import curve_figures, split_figure  # noqa: E402
from reporting.flow_pictures import flow_pictures  # noqa: E402
from launching.programs import solid_names  # noqa: E402
from reporting.solid_pictures import solid_pictures  # noqa: E402

STYLE = """body{font:15px/1.5 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;font-size:13px}td,th{border:1px solid #ccc;padding:3px 8px;
text-align:left}td.n{text-align:right;font-variant-numeric:tabular-nums}td.bad{background:#fbd5d5}
td.good{background:#dcf2dc}img{max-width:100%}figure{margin:1.5em 0}figcaption{color:#555}
pre{background:#f6f6f6;padding:1em;overflow-x:auto;font-size:12px}"""


def _picture(caption: str, figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    plt.close(figure)
    data = base64.b64encode(buffer.getvalue()).decode()
    return (f'<figure><img alt="{html.escape(caption)}" src="data:image/png;base64,{data}">'
            f"<figcaption>{html.escape(caption)}</figcaption></figure>")


def _quantities(summary: dict) -> str:
    rows = ["<tr><th>quantity</th><th>value</th><th>unit</th><th>reference</th><th>error</th>"
            "<th>tolerance</th><th>source</th></tr>"]
    for row in summary["quantities"]:
        error, tolerance = row["relative_error"], row["tolerance"]
        mark = {True: " good", False: " bad", None: ""}[row["within_tolerance"]]
        cells = [
            f"<td>{html.escape(row['name'])}</td>",
            f'<td class="n">{number(row["value"])}</td>',
            f"<td>{html.escape(row['unit'])}</td>",
            f'<td class="n">{"" if row["reference"] is None else number(row["reference"])}</td>',
            f'<td class="n{mark}">{"" if error is None else f"{100 * error:+.2f} %"}</td>',
            f'<td class="n">{"" if tolerance is None else f"{100 * tolerance:g} %"}</td>',
            f"<td>{html.escape(row['source'] or '')}</td>",
        ]
        rows.append("<tr>" + "".join(cells) + "</tr>")
    return "<table>" + "".join(rows) + "</table>"


def _pairs(pairs) -> str:
    rows = (f"<tr><td>{html.escape(str(k))}</td><td>{html.escape(number(v))}</td></tr>"
            for k, v in pairs if v is not None)
    return "<table>" + "".join(rows) + "</table>"


def write_report(out: Path, summary: dict) -> None:
    """report.html in `out` from summary and result files; parts without files are left out."""
    case_file = out / "case.toml"
    text = case_file.read_text() if case_file.is_file() else ""
    axis, position = read_report_keys(tomllib.loads(text), str(case_file))
    set_up = [(k, summary.get(k)) for k in
              ("case", "resolution", "end_time_s", "version", "started_utc", "command")]
    set_up += list(summary.get("machine", {}).items())
    parts = [
        f"<h1>{html.escape(summary['title'] or summary['case'])}</h1>",
        "<h2>Set-up</h2>", _pairs(set_up),
        "<h2>Results</h2>", _quantities(summary),
    ]
    folders = [out, *(out / name for name in solid_names(tomllib.loads(text)))]
    pictures = list(flow_pictures(out, axis, position))
    for folder in folders:
        pictures += solid_pictures(folder, axis, position)
    if pictures:
        parts += ["<h2>Pictures</h2>", *(_picture(*picture) for picture in pictures)]
    curves = [curve for folder in folders for curve in curve_figures(folder)]
    if curves:
        parts += ["<h2>Histories</h2>", *(_picture(*picture) for picture in curves)]
    parts.append("<h2>Run time</h2>")
    split = split_figure(summary["performance"])
    if split:
        parts.append(_picture(*split))
    parts.append(_pairs(summary["performance"].items()))
    if text:
        parts.append(f"<h2>Case with all defaults</h2><pre>{html.escape(text)}</pre>")
    page = (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>'
            f"{html.escape(summary['case'])}</title><style>{STYLE}</style></head><body>"
            f"{''.join(parts)}</body></html>\n")
    aside = out / "report.html.part"
    aside.write_text(page)
    os.replace(aside, out / "report.html")
