/* CHOLMOD (supernodal, its best ordering) and UMFPACK: suitesparse cholmod|umfpack FOLDER THREADS */
#include "system.h"

#include <suitesparse/cholmod.h>
#include <suitesparse/umfpack.h>

static void cholmod(const char *folder, System *s) {
    cholmod_common c;
    cholmod_start(&c);
    c.supernodal = CHOLMOD_SUPERNODAL;
    int upper = (s->entries - s->n) / 2 + s->n, k = 0;
    cholmod_sparse *m = cholmod_allocate_sparse(s->n, s->n, upper, 1, 1, 1, CHOLMOD_REAL, &c);
    int *offsets = m->p, *rows = m->i;
    double *values = m->x;
    for (int j = 0; j < s->n; j++) {
        offsets[j] = k;
        for (int e = s->offsets[j]; e < s->offsets[j + 1]; e++)
            if (s->columns[e] <= j) {
                rows[k] = s->columns[e];
                values[k++] = s->values[e];
            }
    }
    offsets[s->n] = k;
    cholmod_dense *b = cholmod_allocate_dense(s->n, 3, s->n, CHOLMOD_REAL, &c);
    for (int i = 0; i < s->n; i++)
        for (int a = 0; a < 3; a++) ((double *)b->x)[(size_t)a * s->n + i] = s->right[3 * (size_t)i + a];
    from_here();
    double start = seconds();
    cholmod_factor *l = cholmod_analyze(m, &c);
    if (!cholmod_factorize(m, l, &c) || c.status != CHOLMOD_OK) fail("cholmod: no factorization");
    double between = seconds();
    cholmod_dense *x = cholmod_solve(CHOLMOD_A, l, b, &c);
    double end = seconds();
    if (!x) fail("cholmod: no solution");
    report(folder, s, x->x, between - start, end - between, -1);
}

/* The rows of a symmetric matrix are its columns. Long integers: the factors have more entries than short ones count. */
static void umfpack(const char *folder, System *s) {
    size_t n = s->n;
    SuiteSparse_long *offsets = malloc(8 * (n + 1)), *rows = malloc(8 * (size_t)s->entries);
    for (size_t i = 0; i <= n; i++) offsets[i] = s->offsets[i];
    for (int e = 0; e < s->entries; e++) rows[e] = s->columns[e];
    double *x = malloc(24 * n), *b = malloc(24 * n);
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < 3; a++) b[a * n + i] = s->right[3 * i + a];
    from_here();
    double start = seconds();
    void *symbolic, *numeric;
    if (umfpack_dl_symbolic(n, n, offsets, rows, s->values, &symbolic, NULL, NULL) < 0) fail("umfpack: no analysis");
    if (umfpack_dl_numeric(offsets, rows, s->values, symbolic, &numeric, NULL, NULL) < 0) fail("umfpack: no factorization");
    double between = seconds();
    for (int a = 0; a < 3; a++)
        if (umfpack_dl_solve(UMFPACK_A, offsets, rows, s->values, x + a * n, b + a * n, numeric, NULL, NULL) < 0) fail("umfpack: no solution");
    double end = seconds();
    report(folder, s, x, between - start, end - between, -1);
}

int main(int count, char **words) {
    if (count < 3) fail("suitesparse cholmod|umfpack FOLDER");
    System s = read_system(words[2]);
    if (!strcmp(words[1], "cholmod")) cholmod(words[2], &s);
    else umfpack(words[2], &s);
    return 0;
}
