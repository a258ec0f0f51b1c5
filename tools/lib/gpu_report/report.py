"""report.json, rewritten after each step, and report.md."""

import datetime
import json
import os

NEAREST = 10  # rows of checks in the table of those nearest to their tolerance


class Report:
    def __init__(self, session, steps, groups):
        self.session = session
        self.steps = steps
        self.groups = groups
        self.results = []
        self.ended = None  # why the run ended early
        self.date = datetime.datetime.now(datetime.timezone.utc)
        self.write_json()

    def add(self, result):
        self.results.append(result)
        self.write_json()

    def finish(self):
        """Lists the steps that never began, and writes both files."""
        why = self.ended or "the step `adapter` failed"
        for step in self.steps[len(self.results) :]:
            self.results.append(
                {"group": step.group, "name": step.name, "status": "not run", "summary": why,
                 "seconds": 0.0}
            )
        self.ended = self.ended or "complete"
        self.write_json()
        write_whole(self.session.output / "report.md", self.page())

    def count(self, status, group=None):
        """Of `group`, or of all."""
        return sum(
            each["status"] == status and group in (None, each["group"]) for each in self.results
        )

    def is_passed(self):
        bad = self.count("failed") + self.count("not run")
        return self.ended == "complete" and bad == 0 and len(self.results) == len(self.steps)

    def verdict(self):
        word = "passed" if self.is_passed() else "FAILED"
        text = f"{word}: {self.count('passed')} steps passed, {self.count('failed')} failed, "
        text += f"{self.count('not run')} not run"
        if self.count("does not fit"):
            text += f", {self.count('does not fit')} do not fit the adapter"
        return text

    def nearest(self):
        rows = [
            {
                "of": subject,
                "pass": row["pass"],
                "value": row["name"],
                "error": row["worst"]["error"],
                "tolerance": row["worst"]["tolerance"],
                "ratio": row["worst"]["ratio"],
            }
            for subject, row in self.session.rows
        ]
        return sorted(rows, key=lambda row: -row["ratio"])[:NEAREST]

    def write_json(self):
        session = self.session
        text = json.dumps(
            {
                "date": self.date.isoformat(timespec="seconds"),
                "ended": self.ended,
                "passed": self.ended is not None and self.is_passed(),
                "small": session.small,
                "groups": self.groups,
                "minutes": session.minutes,
                "device": session.device,
                "row": self.row(),
                "steps": self.results,
                "nearest_to_tolerance": self.nearest(),
            },
            indent=1,
        )
        write_whole(session.output / "report.json", text + "\n")

    # The page.

    def result(self, name):
        """A passed step of the group `speed`, or an empty dictionary."""
        for each in self.results:
            if (each["group"], each["name"], each["status"]) == ("speed", name, "passed"):
                return each
        return {}

    def row(self):
        """A line for the table in docs/gpus.md."""
        device = self.session.device
        small = self.session.small
        pbf = self.result("PBF 0.01 M" if small else "PBF 2 M").get("ns_per_particle_step")
        flip = self.result("FLIP 0.01 M" if small else "FLIP 0.9 M").get("ms_per_frame")
        statuses = ["passed", "failed"] + ["not run"] * bool(self.count("not run", "correctness"))
        counts = [f"{self.count(each, 'correctness')} {each}" for each in statuses]
        sizes = ("tiny", "tiny") if small else ("1080p", "4K")
        pictures = [
            " / ".join(number(self.result(f"{size} {method}").get("ms_per_frame"), 0)
                       for size in sizes)
            for method in ("splats", "rays")
        ]
        cells = [
            f"{self.date:%Y-%m-%d}",
            device.get("name", "unknown"),
            device.get("driver", "unknown"),
            f"{device.get('swell', 'unknown')} {device.get('commit') or ''}".strip(),
            ", ".join(counts),
            number(pbf, 2),
            number(flip, 2),
            *pictures,
        ]
        return line(cells)

    def page(self):
        session = self.session
        sizes = "0.01 million particles by either solver, pictures of 160 × 90 pixels"
        if not session.small:
            sizes = "2 million particles by PBF, 0.9 million by FLIP, pictures with 16 samples"
        parts = [
            table(
                ["date", "card", "driver", "swell", "correctness", "PBF, ns a particle-step",
                 "FLIP, ms a frame", "splats 1080p / 4K, ms", "rays 1080p / 4K, ms"],
                [self.row()],
            ),
            f"# {session.device.get('name', 'No adapter')}\n\n{self.verdict()}. "
            f"{'' if self.ended == 'complete' else f'It was {self.ended}. '}"
            f"Made by `tools/gpu-report{' --small' if session.small else ''}` in "
            f"{(session.minutes * 60 - session.left()):.0f} s. The table above is of {sizes}.\n",
            self.device_part(),
            *[self.group_part(group) for group in ["device"] + self.groups],
            self.speed_part(),
            self.nearest_part(),
        ]
        return "\n".join(part for part in parts if part)

    def device_part(self):
        device = self.session.device
        if not device:
            return ""
        names = ("name", "kind", "driver", "nvidia_smi")
        rows = [line([key, device[key]]) for key in names if device[key]]
        rows += [line([key, f"{value}"]) for key, value in device["limits"].items()]
        rows += [line([key, "yes" if device[key] else "no"]) for key in ("pass_times", "f64")]
        return "## Device\n\n" + table(["", ""], rows)

    def group_part(self, group):
        rows = [
            line([each["name"], mark(each["status"]), f"{each['seconds']:.1f}", each["summary"]])
            for each in self.results
            if each["group"] == group
        ]
        heading = ["step", "result", "seconds", "what was seen"]
        return f"## Steps: {group}\n\n" + table(heading, rows)

    def speed_part(self):
        measured = [each for each in self.results if "ns_per_particle_step" in each]
        if not measured:
            return ""
        rows = [
            line(
                [
                    each["name"],
                    f"{each['particles']}",
                    number(each["ms_per_frame"], 2),
                    number(each["ms_per_substep"], 2),
                    number(each["ns_per_particle_step"], 2),
                    rate(each),
                    number(each.get("whole_ms_per_frame"), 1),
                    f"{each['device_bytes'] / 1e6:.0f}",
                ]
            )
            for each in measured
        ]
        heading = ["scene wave-city", "particles", "passes, ms a frame", "ms a substep",
                   "ns a particle-step", "GB/s, part of a copy's", "whole frame, ms", "MB"]
        slowest = "\n".join(
            f"- {each['name']}: " + ", ".join(
                f"`{one['pass']}` {one['part_of_time']:.0%} ({rate(one)}, {one['waits_for']})"
                for one in each["slowest"]
            )
            for each in measured
        )
        return f"## Bakes\n\n{table(heading, rows)}\nSlowest passes:\n\n{slowest}\n"

    def nearest_part(self):
        rows = [
            line([row["of"], row["pass"], row["value"], scientific(row["error"]),
                  scientific(row["tolerance"]), scientific(row["ratio"])])
            for row in self.nearest()
        ]
        if not rows:
            return ""
        heading = ["check of", "pass", "value", "error", "tolerance", "error / tolerance"]
        return "## Rows nearest to their tolerance\n\n" + table(heading, rows)


def mark(status):
    return status if status == "passed" else f"**{status}**"


def number(value, digits):
    return "–" if value is None else f"{value:.{digits}f}"


def scientific(value):
    return "–" if value is None else f"{value:.3g}"


def rate(measured):
    part = measured["part_of_bandwidth"]
    return f"{measured['gb_per_s']:.1f}" + ("" if part is None else f", {part:.0%}")


def line(cells):
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def table(heading, rows):
    rule = line(["---"] * len(heading))
    return "\n".join([line(heading), rule] + rows) + "\n"


def write_whole(path, text):
    """Replaces a file at once: a reader never sees half of it."""
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)
