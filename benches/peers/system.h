/* The system of a folder that `assemble --format petsc` wrote with 32-bit indices, the clock, and the line of results. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    int n, entries;
    int *offsets, *columns;
    double *values, *right; /* right: x, y, z of each row in turn */
} System;

static void fail(const char *what) {
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static FILE *open_in(const char *folder, const char *name, const char *mode) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, mode);
    if (!file) fail(path);
    return file;
}

static void read_ints(FILE *file, int *to, size_t count) {
    if (fread(to, 4, count, file) != count) fail("a file that ends too soon");
    for (size_t i = 0; i < count; i++) to[i] = (int)__builtin_bswap32((uint32_t)to[i]);
}

static void swap_doubles(double *x, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, x + i, 8);
        bits = __builtin_bswap64(bits);
        memcpy(x + i, &bits, 8);
    }
}

static void read_doubles(FILE *file, double *to, size_t count) {
    if (fread(to, 8, count, file) != count) fail("a file that ends too soon");
    swap_doubles(to, count);
}

static System read_system(const char *folder) {
    System s;
    int head[4];
    FILE *file = open_in(folder, "M.petsc", "rb");
    read_ints(file, head, 4);
    s.n = head[1];
    s.entries = head[3];
    s.offsets = (int *)malloc(4 * ((size_t)s.n + 1));
    s.columns = (int *)malloc(4 * (size_t)s.entries);
    s.values = (double *)malloc(8 * (size_t)s.entries);
    s.right = (double *)malloc(24 * (size_t)s.n);
    s.offsets[0] = 0;
    read_ints(file, s.offsets + 1, s.n);
    for (int i = 0; i < s.n; i++) s.offsets[i + 1] += s.offsets[i];
    read_ints(file, s.columns, s.entries);
    read_doubles(file, s.values, s.entries);
    fclose(file);
    file = open_in(folder, "R.petsc", "rb");
    read_ints(file, head, 2);
    read_doubles(file, s.right, 3 * (size_t)s.n);
    fclose(file);
    return s;
}

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* From here on the peak of memory is that of the work, and of what is held beside it. */
static void from_here(void) {
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file) {
        fputs("5", file);
        fclose(file);
    }
}

/* The solution, column by column, to X.petsc, and the line of results. */
static void report(const char *folder, const System *s, const double *x, double setup, double solve, int iterations) {
    char line[256], count[16] = "null";
    double megabytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (!strncmp(line, "VmHWM:", 6)) megabytes = atof(line + 6) / 1024;
    if (file) fclose(file);
    uint32_t head[2] = {__builtin_bswap32(1211214), __builtin_bswap32(3 * (uint32_t)s->n)};
    double *points = (double *)malloc(24 * (size_t)s->n);
    for (int i = 0; i < s->n; i++)
        for (int c = 0; c < 3; c++) points[3 * (size_t)i + c] = x[(size_t)c * s->n + i];
    swap_doubles(points, 3 * (size_t)s->n);
    file = open_in(folder, "X.petsc", "wb");
    if (fwrite(head, 4, 2, file) != 2 || fwrite(points, 24, s->n, file) != (size_t)s->n || fclose(file)) fail("X.petsc");
    if (iterations >= 0) snprintf(count, sizeof count, "%d", iterations);
    printf("{\"seconds\": {\"setup\": %.6f, \"solve\": %.6f}, \"megabytes\": %.1f, \"iterations\": %s}\n", setup, solve, megabytes, count);
}
