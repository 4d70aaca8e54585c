"""HTML page of an advice: present setting and forecast, recommended setting, knobs, other engines, code."""

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from sandbox.formatting import format_number
from sandbox.measure.advice.forecast import Risk
from sandbox.measure.advice.result import Advice, MeasuredSetting
from sandbox.measure.advice.text import (
    cheapest_head,
    coverage_sentence,
    engine_text,
    error_text,
    fallback_head,
    figures_text,
    knob_head,
    no_setting_text,
    pixels_text,
    ratio_text,
    recording_sentences,
    risk_label,
    risk_text,
    search_sentence,
    setting_text,
    target_text,
    truth_sentences,
)
from sandbox.report.html.page import (
    Content,
    HtmlColumn,
    Page,
    Section,
    Shade,
    badge,
    concatenated,
    engine_name,
    paragraph,
    remark_paragraphs,
    table,
    write_page,
)

LIKELY = 0.5
"""Odds from which on a risk has the colour of a failure."""


def write_advice(advice: Advice, path: str | Path, on_recording: Sequence[str] = ()) -> Path:
    """Write the page of an advice, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(advice_page(advice, on_recording), path)


def advice_page(advice: Advice, on_recording: Sequence[str] = ()) -> Page:
    """Return the page of an advice, with the remarks on the recording that it is for."""
    sections = [_present(advice), _recommended(advice)]
    if advice.knobs:
        sections.append(Section(knob_head(advice), _knobs(advice)))
    if advice.others:
        sections.append(Section("The same tolerance on the other engines", _engines(advice)))
    if advice.code is not None:
        lines, remarks = "\n".join(advice.code.lines), [paragraph(each) for each in advice.code.remarks]
        body = concatenated(Markup("<pre><code>{}</code></pre>").format(lines), *remarks)
        sections.append(Section("Lines to change in the game", body))
    coverage = coverage_sentence(advice)
    sentences = [
        *filter(None, [coverage]),
        f"{target_text(advice)}.",
        *truth_sentences(advice),
        *recording_sentences(advice),
    ]
    if advice.interrupted:
        sentences.append("Interrupted: only what was measured before is shown.")
    lead = concatenated(*map(paragraph, (*sentences, f"{search_sentence(advice)}.")), remark_paragraphs(on_recording))
    return Page(advice.scene or "Untitled scene", "Advice", sections, lead, advice.versions, advice.machine)


def _present(advice: Advice) -> Section:
    present, parts = advice.present, [paragraph(figures_text(advice, advice.present), "")]
    if advice.risks:
        parts.append(_risks(advice.risks, advice, "Forecast for the present setting"))
    elif present.status != "refused":
        parts.append(paragraph("Forecast: no problem."))
    parts += [paragraph(f"Note: {note}") for note in advice.notes]
    return Section(f"Present setting: {setting_text(present, advice.fps)}", concatenated(*parts))


def _recommended(advice: Advice) -> Section:
    chosen, parts = advice.recommended, list[Content]()
    if chosen is not None:
        parts.append(paragraph(figures_text(advice, chosen), ""))
    if advice.fallback is not None:
        head, setting = fallback_head(advice), setting_text(advice.fallback, advice.fps)
        parts.append(paragraph(f"{head[:1].upper()}{head[1:]}: {setting}; {figures_text(advice, advice.fallback)}"))
        parts += [paragraph(f"Objection: {each}") for each in advice.fallback.objections]
    elif chosen is not None and advice.fits_budget(chosen) is False:
        parts.append(paragraph("No setting that was tried is within the budget."))
    if advice.remaining_risks:
        parts.append(paragraph("Formulas still forecast, although the measured run may not show it:"))
        parts.append(_risks(advice.remaining_risks, advice, "Forecast for the recommended setting"))
    title = no_setting_text(advice) if chosen is None else setting_text(chosen, advice.fps)
    return Section(f"{cheapest_head(advice)}: {title}", concatenated(*parts))


def _risks(risks: Sequence[Risk], advice: Advice, caption: str) -> Markup:
    """Return a row for each risk, the most severe first."""
    columns = HtmlColumn("odds"), HtmlColumn("element"), HtmlColumn("forecast and remedy")
    rows: list[list[Content]] = [
        [badge(risk_label(risk), _shade(risk)), risk.element or "scene", risk_text(risk, advice.fps)] for risk in risks
    ]
    return table(columns, rows, caption)


def _shade(risk: Risk) -> Shade:
    return "bad" if risk.is_observed or (risk.odds or 0.0) >= LIKELY else "fair"


def _error_column(advice: Advice) -> HtmlColumn:
    unit = "px" if advice.tolerance_px is not None else advice.unit
    name = "error" if advice.tolerance_px is not None else advice.metric
    return HtmlColumn(f"{name}{f', {unit}' if unit else ''}", True, advice.metric_about)


def _error_cell(advice: Advice, setting: MeasuredSetting) -> str:
    return pixels_text(setting.error_px) if advice.tolerance_px is not None else format_number(setting.error)


FRAME = HtmlColumn("ms per frame", True, "median of the timings")
COST_RATIO = HtmlColumn("cost ratio", True, "relative to the setting without the change")


def _knobs(advice: Advice) -> Markup:
    columns = HtmlColumn("change"), _error_column(advice), HtmlColumn("error ratio", True), FRAME, COST_RATIO
    rows: list[list[Content]] = [
        [
            knob.change,
            _error_cell(advice, knob.setting) if knob.setting.status == "ok" else error_text(advice, knob.setting),
            ratio_text(knob.error_ratio),
            format_number(knob.setting.frame_ms),
            ratio_text(knob.cost_ratio, knob.cost_ratio_interval),
        ]
        for knob in advice.knobs
    ]
    return table(columns, rows, "One change of the setting")


def _engines(advice: Advice) -> Markup:
    ratio = HtmlColumn("cost ratio", True, "relative to the present setting")
    columns = HtmlColumn("engine"), HtmlColumn("setting"), _error_column(advice), FRAME, ratio
    rows: list[list[Content]] = []
    for other in advice.others:
        setting, remark = other.setting, engine_text(advice, other)
        if setting is None:
            rows.append([engine_name(other.engine), remark, None, None, None])
            continue
        text = setting_text(setting, advice.fps)
        rows.append(
            [
                engine_name(other.engine),
                f"{text}; {remark}" if remark else text,
                _error_cell(advice, setting),
                format_number(setting.frame_ms),
                ratio_text(setting.ratio, setting.ratio_interval),
            ]
        )
    return table(columns, rows, "The same tolerance on the other engines")
