// AMGCL: conjugate gradients with smoothed aggregation or SPAI-0 alone: amgcl amg|spai0 FOLDER THREADS
#include "system.h"

#include <vector>

#include <boost/range/iterator_range.hpp>
#include <boost/tuple/tuple.hpp>

#include <amgcl/adapter/crs_tuple.hpp>
#include <amgcl/amg.hpp>
#include <amgcl/backend/builtin.hpp>
#include <amgcl/coarsening/smoothed_aggregation.hpp>
#include <amgcl/make_solver.hpp>
#include <amgcl/relaxation/as_preconditioner.hpp>
#include <amgcl/relaxation/spai0.hpp>
#include <amgcl/solver/cg.hpp>

typedef amgcl::backend::builtin<double> Backend;
typedef amgcl::solver::cg<Backend> Cg;
typedef amgcl::amg<Backend, amgcl::coarsening::smoothed_aggregation, amgcl::relaxation::spai0> Multigrid;
typedef amgcl::relaxation::as_preconditioner<Backend, amgcl::relaxation::spai0> Spai;

template <class Preconditioner> void solve(const char *folder, const System &s) {
    typedef amgcl::make_solver<Preconditioner, Cg> Solver;
    const size_t n = s.n;
    auto matrix = boost::make_tuple(n, boost::make_iterator_range(s.offsets, s.offsets + n + 1),
                                    boost::make_iterator_range(s.columns, s.columns + s.entries),
                                    boost::make_iterator_range(s.values, s.values + s.entries));
    typename Solver::params parameters;
    parameters.solver.tol = 3e-12;
    parameters.solver.maxiter = 1000;
    from_here();
    double start = seconds();
    Solver solver(matrix, parameters);
    double between = seconds();
    std::vector<double> all(3 * n), b(n), x(n);
    size_t most = 0;
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < n; i++) b[i] = s.right[3 * i + c];
        x.assign(n, 0.0);
        size_t iterations;
        double error;
        boost::tie(iterations, error) = solver(b, x);
        if (iterations > most) most = iterations;
        std::copy(x.begin(), x.end(), all.begin() + c * n);
    }
    report(folder, &s, all.data(), between - start, seconds() - between, (int)most);
}

int main(int count, char **words) {
    if (count < 3) fail("amgcl amg|spai0 FOLDER");
    const System s = read_system(words[2]);
    if (!strcmp(words[1], "amg")) solve<Multigrid>(words[2], s);
    else solve<Spai>(words[2], s);
    return 0;
}
