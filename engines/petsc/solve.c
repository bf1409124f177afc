/* Solves M V = R, as `assemble --format petsc` writes it, on any number of processes:

       mpirun -n P ./solve -dir DIR [-tol 1e-10] [-max_it 10000] [-out FILE] [PETSc's own options]

   By conjugate gradients on D^-1/2 M D^-1/2, D = diag M, from V = P, for x, y and z at once: a MAIJ matrix of three reads the
   entries once for all. It ends when max_i |p_i - (A v)_i| <= tol L, with p - A v = h (R - M V) of the true residual; what ends the
   iterations is the recursive one, and where the two differ they begin again from where they are. Prints one JSON object;
   exit status 0 if converged, else 1, and then nothing is written. */
#include <petscksp.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

static char help[] = "Solves the system of a folder that `assemble --format petsc` wrote: -dir DIR [-tol T] [-max_it K] [-out FILE]\n";

/* What the error of a residual is measured with. */
typedef struct {
  Vec       weight;    /* by row: h sqrt(m_ii), the error that a residual of one in the scaled system is */
  Vec       work;      /* a residual */
  PetscReal least;     /* of the weights */
  PetscReal tolerance; /* absolute */
  PetscInt  rows, before, most;
} Measure;

typedef struct {
  PetscReal max, mean;
} Errors;

/* The largest and the average |w_i r_i| over points of three interleaved coordinates. */
static PetscErrorCode Measured(const Measure *m, Vec residual, Errors *errors)
{
  const PetscScalar *r, *w;
  PetscInt           n;
  PetscReal          max = 0, sum = 0;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(m->weight, &n));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArrayRead(m->weight, &w));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal e = PetscAbsScalar(w[i]) * PetscSqrtReal(r[3 * i] * r[3 * i] + r[3 * i + 1] * r[3 * i + 1] + r[3 * i + 2] * r[3 * i + 2]);
    /* Turned round, so that what is no number is kept. */
    if (!(e <= max)) max = e;
    sum += e;
  }
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArrayRead(m->weight, &w));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &max, 1, MPIU_REAL, MPIU_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPIU_SUM, PETSC_COMM_WORLD));
  errors->max  = max;
  errors->mean = sum / m->rows;
  PetscFunctionReturn(0);
}

/* max_i w_i |r_i| >= min w |r|_2/sqrt(N), so that most iterations need no look at the vector. */
static PetscErrorCode Test(KSP ksp, PetscInt it, PetscReal norm, KSPConvergedReason *reason, void *context)
{
  Measure *m = (Measure *)context;
  Vec      residual;
  Errors   errors;

  PetscFunctionBeginUser;
  *reason = KSP_CONVERGED_ITERATING;
  if (PetscIsInfOrNanReal(norm)) {
    *reason = KSP_DIVERGED_NANORINF;
  } else if (m->least * norm <= m->tolerance * PetscSqrtReal((PetscReal)m->rows)) {
    PetscCall(KSPBuildResidual(ksp, NULL, m->work, &residual));
    PetscCall(Measured(m, residual, &errors));
    if (errors.max <= m->tolerance) *reason = KSP_CONVERGED_ATOL;
  }
  if (*reason == KSP_CONVERGED_ITERATING && m->before + it >= m->most) *reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(0);
}

static PetscErrorCode Open(const char *dir, const char *name, PetscViewer *viewer)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(path, sizeof path, "%s/%s", dir, name));
  PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, path, FILE_MODE_READ, viewer));
  PetscFunctionReturn(0);
}

/* A vector of n local numbers in blocks of the given size. */
static PetscErrorCode Load(const char *dir, const char *name, PetscInt n, PetscInt block, Vec *v)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(Open(dir, name, &viewer));
  PetscCall(VecCreate(PETSC_COMM_WORLD, v));
  PetscCall(VecSetSizes(*v, n, PETSC_DETERMINE));
  PetscCall(VecSetBlockSize(*v, block));
  PetscCall(VecSetFromOptions(*v));
  PetscCall(VecLoad(*v, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(0);
}

/* Beside, then renamed: no half a solution has the name. */
static PetscErrorCode Save(const char *path, Vec v)
{
  char        beside[PETSC_MAX_PATH_LEN];
  PetscViewer viewer;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(beside, sizeof beside, "%s.tmp", path));
  PetscCall(PetscViewerCreate(PETSC_COMM_WORLD, &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_WRITE));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
  PetscCall(PetscViewerFileSetName(viewer, beside));
  PetscCall(VecView(v, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank == 0) PetscCheck(rename(beside, path) == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot rename %s to %s", beside, path);
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(0);
}

/* How many points of others a rank needs for a product, and of how many ranks. */
static PetscErrorCode Halo(Mat matrix, PetscMPIInt size, PetscInt most[2], PetscInt *total)
{
  const PetscInt *range, *columns;
  Mat             inner, outer;
  PetscInt        count = 0, ranks = 0;

  PetscFunctionBeginUser;
  most[0] = most[1] = *total = 0;
  if (size == 1) PetscFunctionReturn(0);
  PetscCall(MatMPIAIJGetSeqAIJ(matrix, &inner, &outer, &columns));
  PetscCall(MatGetSize(outer, NULL, &count));
  PetscCall(MatGetOwnershipRanges(matrix, &range));
  /* Ascending: each rank's points are neighbours. */
  for (PetscInt i = 0, rank = -1; i < count; i++) {
    if (rank >= 0 && columns[i] < range[rank + 1]) continue;
    for (rank++; columns[i] >= range[rank + 1]; rank++) { }
    ranks++;
  }
  most[0] = count;
  most[1] = ranks;
  *total  = count;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, total, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  char           dir[PETSC_MAX_PATH_LEN] = ".", out[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN];
  PetscBool      is_named = PETSC_FALSE, has_length = PETSC_FALSE;
  PetscReal      tol = 1e-10, length = 0;
  PetscInt       rows, low, high, most[2], total, bits = 0, iterations = 0, rounds = 0;
  PetscMPIInt    rank, size;
  PetscLogDouble clock[5];
  PetscOptions   manifest;
  PetscViewer    viewer;
  Mat            matrix, three;
  Vec            right, right3, start, solution, d, d3, h;
  KSP            ksp;
  PC             pc;
  Measure        measure;
  Errors         errors;
  struct rusage  usage;
  double         megabytes;
  const char    *type;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  measure.most = 10000;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-dir", dir, sizeof dir, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-tol", &tol, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-max_it", &measure.most, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-out", out, sizeof out, &is_named));
  if (!is_named) PetscCall(PetscSNPrintf(out, sizeof out, "%s/X.petsc", dir));

  PetscCall(PetscTime(&clock[0]));
  /* JSON is YAML, which PETSc reads as options: a database of its own for these. */
  PetscCall(PetscSNPrintf(path, sizeof path, "%s/manifest.json", dir));
  PetscCall(PetscOptionsCreate(&manifest));
  PetscCall(PetscOptionsInsertFileYAML(PETSC_COMM_WORLD, manifest, path, PETSC_TRUE));
  PetscCall(PetscOptionsGetReal(manifest, NULL, "-diagonal", &length, &has_length));
  PetscCheck(has_length && length > 0, PETSC_COMM_WORLD, PETSC_ERR_FILE_UNEXPECTED, "%s tells no diagonal", path);
  PetscCall(PetscOptionsGetInt(manifest, NULL, "-index", &bits, NULL));
  PetscCheck(bits == 8 * (PetscInt)sizeof(PetscInt), PETSC_COMM_WORLD, PETSC_ERR_FILE_UNEXPECTED,
             "%s: indices of %d bits, and this PETSc has %d: assemble --index %d", path, (int)bits, (int)(8 * sizeof(PetscInt)), (int)(8 * sizeof(PetscInt)));
  PetscCall(PetscOptionsDestroy(&manifest));
  measure.tolerance = tol * length;

  PetscCall(Open(dir, "M.petsc", &viewer));
  PetscCall(MatCreate(PETSC_COMM_WORLD, &matrix));
  PetscCall(MatSetType(matrix, MATAIJ));
  PetscCall(MatLoad(matrix, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(MatGetSize(matrix, &rows, NULL));
  PetscCall(MatGetOwnershipRange(matrix, &low, &high));
  PetscCall(Load(dir, "R.petsc", 3 * (high - low), 3, &right));
  PetscCall(Load(dir, "H.petsc", high - low, 1, &h));
  PetscCall(PetscTime(&clock[1]));

  /* D^-1/2 M D^-1/2 y = D^-1/2 R, V = D^-1/2 y. */
  PetscCall(MatCreateVecs(matrix, &d, NULL));
  PetscCall(MatGetDiagonal(matrix, d));
  PetscCall(VecSqrtAbs(d));
  PetscCall(VecDuplicate(h, &measure.weight));
  PetscCall(VecPointwiseMult(measure.weight, h, d));
  PetscCall(VecMin(measure.weight, NULL, &measure.least));
  measure.rows = rows;
  PetscCall(VecDuplicate(right, &d3));
  PetscCall(VecDuplicate(right, &start));
  PetscCall(VecDuplicate(right, &solution));
  PetscCall(VecDuplicate(right, &measure.work));
  PetscCall(VecDuplicate(right, &right3));
  /* From V = P = h R: y = D^1/2 h R. */
  for (PetscInt c = 0; c < 3; c++) PetscCall(VecStrideScatter(measure.weight, c, d3, INSERT_VALUES));
  PetscCall(VecPointwiseMult(start, right, d3));
  PetscCall(VecReciprocal(d));
  for (PetscInt c = 0; c < 3; c++) PetscCall(VecStrideScatter(d, c, d3, INSERT_VALUES));
  PetscCall(VecPointwiseMult(right, right, d3));
  PetscCall(VecCopy(start, solution));
  PetscCall(VecDestroy(&start));
  PetscCall(MatDiagonalScale(matrix, d, d));
  PetscCall(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(matrix, MAT_SPD, PETSC_TRUE));
  PetscCall(MatCreateMAIJ(matrix, 3, &three));
  PetscCall(MatSetOption(three, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(three, MAT_SPD, PETSC_TRUE));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCNONE));
  PetscCall(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
  PetscCall(KSPSetOperators(ksp, three, three));
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, measure.most + 1));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSetConvergenceTest(ksp, Test, &measure, NULL));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetType(ksp, &type));
  PetscCall(Halo(matrix, size, most, &total));
  PetscCall(PetscTime(&clock[2]));

  for (;; rounds++) {
    PetscInt  made = 0;
    PetscReal before = rounds ? errors.max : PETSC_INFINITY;

    measure.before = iterations;
    PetscCall(KSPSolve(ksp, right, solution));
    PetscCall(KSPGetIterationNumber(ksp, &made));
    iterations += made;
    PetscCall(MatMult(three, solution, right3));
    PetscCall(VecAYPX(right3, -1, right));
    PetscCall(Measured(&measure, right3, &errors));
    /* Done, or nothing gained by beginning again: that is rounding. */
    if (errors.max <= measure.tolerance || iterations >= measure.most || !(errors.max < 0.5 * before)) break;
  }
  PetscCall(VecPointwiseMult(solution, solution, d3));
  PetscCall(PetscTime(&clock[3]));

  PetscBool converged = errors.max <= measure.tolerance ? PETSC_TRUE : PETSC_FALSE;
  if (converged) PetscCall(Save(out, solution));
  PetscCall(PetscTime(&clock[4]));
  getrusage(RUSAGE_SELF, &usage);
  megabytes = usage.ru_maxrss / 1024.0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &megabytes, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
    "{\n  \"program\": \"petsc\",\n  \"version\": \"%d.%d.%d\",\n  \"method\": \"%s\",\n  \"ranks\": %d,\n  \"rows\": %lld,\n"
    "  \"iterations\": %lld,\n  \"restarts\": %lld,\n  \"status\": \"%s\",\n  \"max_error\": %.17g,\n  \"mean_error\": %.17g,\n  \"tolerance\": %.17g,\n"
    "  \"halo\": {\"largest\": %lld, \"neighbours\": %lld, \"total\": %lld},\n  \"megabytes\": %.0f,\n"
    "  \"seconds\": {\"read\": %.6f, \"assemble\": %.6f, \"solve\": %.6f, \"write\": %.6f}\n}\n",
    PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR, type, size, (long long)rows, (long long)iterations, (long long)rounds,
    converged ? "converged" : (iterations >= measure.most ? "max-iterations" : "stagnated"), (double)errors.max, (double)errors.mean,
    (double)measure.tolerance, (long long)most[0], (long long)most[1], (long long)total, megabytes, clock[1] - clock[0], clock[2] - clock[1],
    clock[3] - clock[2], clock[4] - clock[3]));

  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&three));
  PetscCall(MatDestroy(&matrix));
  Vec all[] = {right, right3, solution, d, d3, h, measure.weight, measure.work};
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) PetscCall(VecDestroy(&all[i]));
  PetscCall(PetscFinalize());
  return converged ? 0 : 1;
}
