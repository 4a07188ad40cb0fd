"""recompute.py EVALUATION: judges what `vantage evaluate` wrote, from its scans.csv alone.

Every run's numbers are computed anew from scans.csv (errors from the two poses of a line) and
compared with the run's summary.json, the summary of all runs, and every cell of report.html that
says which number it shows. Table 1 is counted in the bundles' own index. Prints how many numbers
agree; exit code 1 with one line for each that does not. Python's standard library only.
"""
import csv
import json
import math
import os
import struct
import sys
import tomllib
from html.parser import HTMLParser

# Columns of scans.csv that are no metric.
NO_METRICS = {"stamp", "tracking", "region", "termination", "distance_m", "reason"} | {
    prefix + name for prefix in ("", "ref_") for name in ("x", "y", "z", "qx", "qy", "qz", "qw")
} | {
    f"cov_{a}_{b}"
    for k, a in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    for b in ("x", "y", "z", "rx", "ry", "rz")[k:]
}

problems = []
compared = 0


def compare(what, expected, found, tolerance=1e-9, absolute=1e-12):
    global compared
    compared += 1
    if expected is None or found is None:
        if expected is not found:
            problems.append(f"{what}: recomputed {expected}, found {found}")
    elif not math.isclose(expected, found, rel_tol=tolerance, abs_tol=absolute):
        problems.append(f"{what}: recomputed {expected!r}, found {found!r}")


def percentile(ordered, share):
    """Linear between neighbours."""
    at = share * (len(ordered) - 1)
    low = math.floor(at)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (at - low) * (ordered[high] - ordered[low])


def statistics(sample):
    if not sample:
        return {"count": 0}
    n = len(sample)
    mean = math.fsum(sample) / n
    ordered = sorted(sample)
    return {
        "count": n,
        "mean": mean,
        "rmse": math.sqrt(math.fsum(x * x for x in sample) / n),
        "std": math.sqrt(math.fsum((x - mean) ** 2 for x in sample) / n),
        "min": ordered[0],
        "median": percentile(ordered, 0.5),
        "p95": percentile(ordered, 0.95),
        "p99": percentile(ordered, 0.99),
        "max": ordered[-1],
    }


# A pose is (x, y, z, qx, qy, qz, qw).
def pose(row, prefix):
    cells = [row[prefix + name] for name in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    return None if "" in cells else tuple(map(float, cells))


def conjugate(q):
    return (-q[0], -q[1], -q[2], q[3])


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q, v):
    return product(product(q, (*v, 0.0)), conjugate(q))[:3]


def motion(start, end):
    """end seen from start."""
    back = conjugate(start[3:])
    offset = tuple(end[i] - start[i] for i in range(3))
    return (*rotate(back, offset), *product(back, end[3:]))


def degrees(q):
    return math.degrees(2.0 * math.atan2(math.hypot(*q[:3]), abs(q[3])))


def difference(a, b):
    """Metres and degrees."""
    return math.dist(a[:3], b[:3]), degrees(product(conjugate(b[3:]), a[3:]))


def relative_errors(rows, truth, found, tracked, step):
    way, ways, last = 0.0, [], None
    for at in truth:
        if at is not None:
            if last is not None:
                way += math.dist(at[:3], last[:3])
            last = at
        ways.append(way)
    metres, turns = [], []
    for i in range(len(rows)):
        j = i + 1
        while j < len(rows) and ways[j] - ways[i] < step:
            j += 1
        if j >= len(rows) or not (tracked[i] and tracked[j]) or None in (truth[i], truth[j]):
            continue
        error = motion(motion(truth[i], truth[j]), motion(found[i], found[j]))
        metres.append(math.hypot(*error[:3]))
        turns.append(degrees(error[3:]))
    return {"m": statistics(metres), "deg": statistics(turns)}


def recompute(path, alert_limit):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    tracked = [row["tracking"] == "tracked" for row in rows]
    for i, row in enumerate(rows):
        if row["tracking"] not in ("tracked", "uncertain", "lost"):
            problems.append(f"{path}:{i + 2}: no state: {row['tracking']}")
        if (row["risk"] != "") != (row["x"] != "") or not 0.0 <= float(row["risk"] or 0.0) <= 1.0:
            problems.append(f"{path}:{i + 2}: no risk of the pose: {row['risk']!r}")
    truth = [pose(row, "ref_") for row in rows]
    found = [pose(row, "") for row in rows]
    errors = [
        difference(f, t) if f is not None and t is not None else None for f, t in zip(found, truth)
    ]
    for i, row in enumerate(rows):
        if errors[i] is None:
            continue
        compare(f"{path}:{i + 2}: error_m", errors[i][0], float(row["error_m"]), 1e-6, 1e-9)
        compare(f"{path}:{i + 2}: error_deg", errors[i][1], float(row["error_deg"]), 1e-4, 1e-5)

    def column(name, which=tracked):
        return statistics([float(r[name]) for r, w in zip(rows, which) if w and r[name] != ""])

    everywhere = [True] * len(rows)
    switched = [row["switched"] == "1" for row in rows]
    good = [e for e, t in zip(errors, tracked) if t and e is not None]
    far = [e is not None and (e[0] > 2.0 or e[1] > 5.0) for e in errors]
    beyond_alert = [e is not None and (e[0] > alert_limit["m"] or e[1] > alert_limit["deg"]) for e in errors]
    lcp = statistics(
        [float(r["fitness"]) / float(r["map_points"])
         for r, t in zip(rows, tracked) if t and r["fitness"] and r["map_points"]]
    )
    def total(name):
        return sum(int(row[name]) for row in rows)

    seen = any(e is not None for e in errors)
    numbers = {
        "scans": {
            "total": len(rows),
            "tracked": sum(tracked),
            "lost": sum(row["tracking"] == "lost" for row in rows),
            "uncertain": sum(row["tracking"] == "uncertain" for row in rows),
            "far_off": sum(far) if seen else None,
            "wrong": sum(f and t for f, t in zip(far, tracked)) if good else None,
            "misleading": sum(b and t for b, t in zip(beyond_alert, tracked)) if good else None,
            "recovered": total("recovered"),
            "switched": sum(switched[1:]),
            "outside": total("outside"),
            "blocked": total("blocked"),
            "dropped_points": total("dropped_points"),
            "doubted": total("doubted"),
        },
        "lcp": lcp,
        "error_m": statistics([e[0] for e in good]),
        "error_deg": statistics([e[1] for e in good]),
        "relative_error": {
            "next_scan": relative_errors(rows, truth, found, tracked, 0.0),
            "10m": relative_errors(rows, truth, found, tracked, 10.0),
        },
    }
    of_tracked = ["iterations", "fitness", "nvtl", "coverage", "sigma_m", "sigma_deg", "degenerate", "correction_m"]
    # All others are of every scan.
    of_all = [name for name in rows[0] if name not in NO_METRICS | numbers.keys() | numbers["scans"].keys()
              and name not in of_tracked]
    numbers |= {name: column(name, everywhere) for name in of_all}
    numbers |= {name: column(name) for name in of_tracked}
    if not good:  # a run without a tracked scan says nothing of errors
        del numbers["relative_error"]
    return numbers


def tolerances(where):
    """Times have four digits after the point in scans.csv; angles of next to nothing are noise."""
    if "_ms" in where:
        return {"tolerance": 1e-9, "absolute": 1e-4}
    if "deg" in where:
        return {"tolerance": 1e-4, "absolute": 1e-5}
    return {"tolerance": 1e-6, "absolute": 1e-9}


def compare_tree(where, expected, found):
    for key, value in expected.items():
        if key not in found:
            problems.append(f"{where}.{key}: missing")
        elif isinstance(value, dict):
            compare_tree(f"{where}.{key}", value, found[key])
        else:
            compare(f"{where}.{key}", value, found[key], **tolerances(f"{where}.{key}"))


def at_path(tree, path):
    for key in path.split("."):
        tree = tree[key]
    return tree


class Cells(HTMLParser):
    """The elements that say which number they show."""

    def __init__(self):
        super().__init__()
        self.cells = []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if "data-metric" in attributes:
            self.cells.append(attributes)


def points_of_regions(bundle):
    """Points of each region, from the entries of regions.idx (the README of pcd_tiles)."""
    with open(os.path.join(bundle, "regions.idx"), "rb") as file:
        data = file.read()
    at = 0

    def skip(size):
        nonlocal at
        at += size

    def take(layout):
        values = struct.unpack_from("<" + layout, data, at)
        skip(struct.calcsize("<" + layout))
        return values if len(values) > 1 else values[0]

    title, version, count = struct.unpack_from("<16sQQ", data, len(data) - 4096)
    assert (title, version) == (b"vantage regions\n", 3)
    regions = []
    for number in range(count):
        assert take("I") == number
        skip(take("Q"))  # the label
        if take("I") == 1:
            skip(32)  # a box
        elif take("I") == 1:
            skip(32 * take("Q"))  # boxes
        else:
            assert take("I") == 1
            skip(16 * take("Q"))  # corners
        skip(16)  # height
        points, _, _, _ = take("QQQQ")
        if take("I") == 1:
            skip(8)  # the most views
        regions.append(points)
        skip(8 + 24 + 8 + 8)  # bytes, origin, checksums of the file and of the entry
    return regions


def table_1(config):
    with open(config["config"], "rb") as file:
        store = tomllib.load(file)["store"]["params"]["root"]
    bundle = os.path.join(os.path.dirname(config["config"]), store)
    with open(os.path.join(bundle, "index.json")) as file:
        content = json.load(file)
    regions = points_of_regions(bundle)
    points = statistics(regions)
    size = sum(
        os.path.getsize(os.path.join(path, name))
        for path, _, names in os.walk(bundle)
        for name in names
    )
    return {
        "regions": len(regions),
        "map_points": content["map"]["points"],
        "points_per_region": points,
        "bytes": size,
        "reduction": 1.0 - points["mean"] / content["map"]["points"],
    }


def main(folder):
    with open(os.path.join(folder, "summary.json")) as file:
        summary = json.load(file)
    runs, configs = {}, {}
    for config in summary["configs"]:
        configs[config["name"]] = table_1(config)
        compare_tree(config["name"], configs[config["name"]], config)
        for run in config["routes"]:
            for name, found in [("observable", run), *run.get("baselines", {}).items()]:
                path = os.path.join(folder, config["name"], run["route"])
                if name != "observable":
                    path = os.path.join(path, name)
                where = f"{config['name']}/{run['route']}/{name}"
                with open(os.path.join(path, "summary.json")) as file:
                    written = json.load(file)
                numbers = recompute(os.path.join(path, "scans.csv"), written["alert_limit"])
                runs[config["name"], run["route"], name] = numbers
                compare_tree(where, numbers, found)
                compare_tree(path, numbers, written)
    cells = Cells()
    with open(os.path.join(folder, "report.html")) as file:
        cells.feed(file.read())
    shown = set()
    for cell in cells.cells:
        metric = cell["data-metric"]
        if metric == "map.points":
            sizes = {config["map_points"] for config in configs.values()}
            compare("report.html: points of the map", sizes.pop(), float(cell["data-value"]))
            continue
        name = cell["data-config"]
        where = f"report.html: {metric} of {name} {cell.get('data-route')} {cell.get('data-map')}"
        if "data-route" in cell:
            key = (name, cell["data-route"], cell["data-map"])
            shown.add(key)
            expected = runs[key]
        else:
            expected = configs[name]
        value = at_path(expected, metric)
        compare(where, value, float(cell["data-value"]), **tolerances(metric))
    for run in set(runs) - shown:
        problems.append(f"report.html: no number of {run}")
    for problem in problems:
        print(problem)
    print(f"{compared} numbers compared, {len(problems)} differ; {len(cells.cells)} cells of the report")
    return 1 if problems or compared == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
