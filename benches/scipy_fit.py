#!/usr/bin/env python3
"""The baseline for `freeswing fit`: the same fit with scipy's solve_ivp and least_squares.

A chain of two links under gravity with a spring K and a damper C between them and a viscous hinge c. Free are K, C, c and the four initial
values; the cost is the sum of squared differences of both angles at the frames' own times.

    benches/scipy_fit.py angles.csv --config experiment.toml [--method auto|RK45|DOP853|LSODA] [--solver trf|lm]

Starts from the file's coefficients, the first frame's angles, and rest. Prints one line of JSON: parameters, standard errors, residual rms,
counts, and the seconds of the fit alone (wall and processor), without Python's start and the reading of files. `auto` times every method
once at the start values and takes the fastest.
Needs Python 3.11 with numpy and scipy.
"""

import argparse
import csv
import json
import math
import os
import time
import tomllib

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one core, as the fit it is compared with

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

METHODS = ["RK45", "DOP853", "LSODA"]
NAMES = [
    "k_eq_n_m_per_rad",
    "c_eq_n_m_s_per_rad",
    "hinge_viscous",
    "theta1_rad",
    "theta2_rad",
    "omega1_rad_s",
    "omega2_rad_s",
]


def links(specimen):
    """Length, mass, distance from pivot to centre of mass, and inertia about it, of both links."""
    if specimen.get("links"):
        chain = [(l["length_m"], l["mass_kg"], l["com_m"], l["inertia_kg_m2"]) for l in specimen["links"]]
    else:
        lengths = specimen.get("link_lengths_m", [0.10, 0.10])
        mass, total = specimen.get("mass_kg", 0.3606e-3), sum(lengths)
        if specimen.get("inertia", "rods") == "lumps":
            halves = [0.5 * length / total for length in lengths]
            shares = specimen.get("lumps") or [halves[0], sum(halves), halves[-1]]
            chain = [(length, mass * share, length, 0.0) for length, share in zip(lengths, shares[1:])]
        else:
            chain = [(l, mass * l / total, 0.5 * l, mass * l / total * l * l / 12.0) for l in lengths]
    if len(chain) != 2:
        raise SystemExit(f"the baseline knows two links, not {len(chain)}")
    return chain


def two_links(specimen, gravity):
    """a11, a12, a22 (kg m2) and g1, g2 (N m) of the equations of motion."""
    (l1, m1, c1, i1), (_, m2, c2, i2) = links(specimen)
    return (
        i1 + m1 * c1**2 + m2 * l1**2,
        l1 * m2 * c2,
        i2 + m2 * c2**2,
        gravity * (m1 * c1 + m2 * l1),
        gravity * m2 * c2,
    )


def derivative(constants):
    a11, a12, a22, g1, g2 = constants
    sin, cos = math.sin, math.cos

    def flow(_t, y, k, c, hinge):
        theta1, theta2, omega1, omega2 = y.tolist()  # plain floats are faster than numpy's one by one
        joint = k * (theta2 - theta1) + c * (omega2 - omega1)
        turn, coupling = a12 * sin(theta1 - theta2), a12 * cos(theta1 - theta2)
        q1 = joint - turn * omega2 * omega2 - g1 * sin(theta1) - hinge * omega1
        q2 = turn * omega1 * omega1 - g2 * sin(theta2) - joint
        determinant = a11 * a22 - coupling * coupling
        return [omega1, omega2, (a22 * q1 - coupling * q2) / determinant, (a11 * q2 - coupling * q1) / determinant]

    return flow


def read_angles(path):
    with open(path, newline="") as file:
        rows = [
            [float(row[key]) for key in ("t_s", "theta1_rad", "theta2_rad")]
            for row in csv.DictReader(file)
            if row["theta1_rad"] and row["theta2_rad"]
        ]
    table = np.array(rows)
    return table[:, 0] - table[0, 0], table[:, 1:]


def start_values(model, angles):
    """The file's coefficients, the angles of the first frame, at rest."""
    return np.array(
        [
            model.get("k_eq_n_m_per_rad", 2.0e-4),
            model.get("c_eq_n_m_s_per_rad", 2.0e-6),
            model.get("effects", {}).get("hinge_viscous", 1.0e-7),
            *angles[0],
            0.0,
            0.0,
        ]
    )


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("angles")
    arguments.add_argument("--config", required=True)
    arguments.add_argument("--method", default="auto", choices=["auto", *METHODS])
    arguments.add_argument("--solver", default="trf", choices=["trf", "lm"])
    arguments = arguments.parse_args()

    with open(arguments.config, "rb") as file:
        config = tomllib.load(file)
    times, angles = read_angles(arguments.angles)
    gravity = config.get("rig", {}).get("gravity_m_s2", 9.80665)
    flow = derivative(two_links(config.get("specimen", {}), gravity))
    start = start_values(config.get("model", {}), angles)

    # Fitted are u = 1 + (value - start) / scale, all near 1: differences over 1e-4 of each scale stand above the integrator's own error.
    scale = np.concatenate([np.maximum(np.abs(start[:3]), 1e-9), [1.0, 1.0, 10.0, 10.0]])

    def residuals(u, method):
        values = start + (u - 1.0) * scale
        swing = solve_ivp(
            flow, (0.0, times[-1]), values[3:], method=method, t_eval=times, args=tuple(values[:3]), rtol=1e-8, atol=1e-10
        )
        return (swing.y[:2].T - angles).ravel()

    ones = np.ones(start.size)

    def seconds(method):
        begun = time.perf_counter()
        residuals(ones, method)
        return time.perf_counter() - begun

    method = min(METHODS, key=seconds) if arguments.method == "auto" else arguments.method
    begun, begun_processor = time.perf_counter(), time.process_time()
    fit = least_squares(
        residuals, ones, jac="2-point", diff_step=1e-4, x_scale="jac", method=arguments.solver, args=(method,)
    )
    elapsed, elapsed_processor = time.perf_counter() - begun, time.process_time() - begun_processor
    values = start + (fit.x - 1.0) * scale
    variance = 2.0 * fit.cost / (fit.fun.size - fit.x.size)
    errors = np.sqrt(variance * np.diag(np.linalg.pinv(fit.jac.T @ fit.jac))) * scale
    answer = {
        "parameters": dict(zip(NAMES, values.tolist())),
        "standard_errors": dict(zip(NAMES, errors.tolist())),
        "residual_rms_rad": math.sqrt(2.0 * fit.cost / fit.fun.size),
        "method": method,
        "solver": arguments.solver,
        "residual_evaluations": fit.nfev,
        "jacobian_evaluations": fit.njev,
        "message": fit.message,
        "seconds": elapsed,
        "processor_seconds": elapsed_processor,
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
