"""One peer of Python on the system that `assemble --format petsc` wrote: peers.py METHOD FOLDER THREADS.

Writes FOLDER/X.petsc and prints one JSON object: seconds of set-up and of three right-hand sides, the peak of the resident set
in MB, iterations where there are some. A package that is missing gives {"missing": NAME}. The error is measured by who called.
"""

import importlib
import json
import os
import sys
import time

METHOD, FOLDER, THREADS = sys.argv[1], sys.argv[2], int(sys.argv[3])
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = str(THREADS)


def need(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        print(json.dumps({"missing": name}))
        sys.exit(0)


np = need("numpy")
sp = need("scipy.sparse")
linalg = need("scipy.sparse.linalg")


def read():
    """M and R; columns may stay 32-bit, as all of these libraries take them."""
    with open(f"{FOLDER}/M.petsc", "rb") as file:
        _, n, _, entries = np.fromfile(file, ">i4", 4)
        lengths = np.fromfile(file, ">i4", n)
        columns = np.fromfile(file, ">i4", entries).astype(np.int32)
        values = np.fromfile(file, ">f8", entries).astype(float)
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    right = np.fromfile(f"{FOLDER}/R.petsc", ">f8", offset=8).astype(float).reshape(n, 3)
    return sp.csr_matrix((values, columns, offsets), shape=(n, n)), right


def columns(solve, right):
    """Each right-hand side by itself, and the most iterations of one."""
    solutions, most = [], 0
    for c in range(3):
        count = [0]

        def see(_):
            count[0] += 1

        solutions.append(solve(np.ascontiguousarray(right[:, c]), see))
        most = max(most, count[0])
    return np.stack(solutions, 1), most


def superlu(m, right):
    options = dict(permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=dict(SymmetricMode=True))
    m = m.tocsc()
    factor = yield lambda: linalg.splu(m, **options)
    yield lambda: (factor.solve(right), None)


def umfpack(m, right):
    library = need("scikits.umfpack")
    m = m.tocsc()
    factor = yield lambda: library.splu(m)
    yield lambda: (np.stack([factor.solve(right[:, c]) for c in range(3)], 1), None)


def cholmod(m, right):
    library = need("sksparse.cholmod")
    m = m.tocsc()
    factor = yield lambda: library.cholesky(m)
    yield lambda: (factor(right), None)


def pardiso(m, right):
    library = need("pypardiso")
    upper = sp.triu(m, format="csr")
    upper.sort_indices()
    solver = library.PyPardisoSolver(mtype=2)
    solver.set_iparm(1, 1)
    solver.set_iparm(2, 3 if THREADS > 1 else 2)
    # It asks for all entries, and a symmetric positive definite matrix is given by its upper triangle.
    solver._check_A = lambda *_: None
    nothing = np.zeros((m.shape[0], 1))

    def factorize():
        for phase in (11, 22):
            solver.set_phase(phase)
            solver._call_pardiso(upper, nothing)

    def solve():
        solver.set_phase(33)
        return solver._call_pardiso(upper, np.asfortranarray(right)), None

    yield factorize
    yield solve


def cg(m, right):
    scale = yield lambda: 1 / m.diagonal()
    jacobi = linalg.LinearOperator(m.shape, lambda x: scale * x)
    one = lambda b, see: linalg.cg(m, b, rtol=3e-12, maxiter=3000, M=jacobi, callback=see)[0]
    yield lambda: columns(one, right)


def multigrid(m, right):
    library = need("pyamg")
    levels = yield lambda: library.smoothed_aggregation_solver(m)
    one = lambda b, see: levels.solve(b, tol=3e-12, accel="cg", maxiter=1000, callback=see)
    yield lambda: columns(one, right)


METHODS = {
    "superlu": superlu,
    "umfpack": umfpack,
    "cholmod": cholmod,
    "pardiso": pardiso,
    "scipy-cg": cg,
    "pyamg": multigrid,
}


def memory(field):
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) / 1024 for line in file if line.startswith(field))


def main():
    m, right = read()
    steps = METHODS[METHOD](m, right)
    set_up = next(steps)
    try:
        # From here on the peak is that of the work, and of what is held beside it.
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")
    except OSError:
        pass
    start = time.perf_counter()
    ready = set_up()
    between = time.perf_counter()
    solve = steps.send(ready)
    again = time.perf_counter()
    solution, iterations = solve()
    end = time.perf_counter()
    with open(f"{FOLDER}/X.petsc", "wb") as file:
        file.write(np.array([1211214, solution.size], ">i4").tobytes())
        file.write(np.ascontiguousarray(solution, ">f8").tobytes())
    seconds = {"setup": between - start, "solve": end - again}
    print(json.dumps({"seconds": seconds, "megabytes": memory("VmHWM"), "iterations": iterations}))


main()
