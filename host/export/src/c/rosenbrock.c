/* Derivatives of the rates where the machine is, with respect to states and time: the same for all sizes of a step from there. */
static void linearise(@n@_machine *m) {
    int i, k;
    for (i = 0; i < SEEDS; ++i) {
        m->seed[i] = R(0.0);
    }
    for (k = 0; k <= @N@_STATES; ++k) {
        real *const found = k == 0 ? m->by_time : m->stage;
        m->seed[k] = R(1.0);
        rate_tangents(m, m->time, m->state, found);
        m->seed[k] = R(0.0);
        for (i = 0; k > 0 && i < @N@_STATES; ++i) {
            m->jacobian[i][k - 1] = found[i];
        }
    }
}

/* 1 / (h gamma) - J as product of triangles, with exchanges of rows (Golub & Van Loan, algorithm 3.4.1). */
static int factor(@n@_machine *m, real h) {
    const real diagonal = R(1.0) / (h * method_gamma);
    int i, j, k;
    for (i = 0; i < @N@_STATES; ++i) {
        for (j = 0; j < @N@_STATES; ++j) {
            m->matrix[i][j] = -m->jacobian[i][j];
        }
        m->matrix[i][i] += diagonal;
    }
    for (k = 0; k < @N@_STATES; ++k) {
        int best = k;
        real pivot;
        for (i = k + 1; i < @N@_STATES; ++i) {
            if (F(fabs)(m->matrix[i][k]) > F(fabs)(m->matrix[best][k])) {
                best = i;
            }
        }
        m->exchanged[k] = best;
        for (j = 0; j < @N@_STATES; ++j) {
            const real kept = m->matrix[k][j];
            m->matrix[k][j] = m->matrix[best][j];
            m->matrix[best][j] = kept;
        }
        pivot = m->matrix[k][k];
        if (!(F(fabs)(pivot) > R(0.0)) || !(pivot - pivot == R(0.0))) {
            return @N@_NOT_FINITE;
        }
        for (i = k + 1; i < @N@_STATES; ++i) {
            const real share = m->matrix[i][k] / pivot;
            m->matrix[i][k] = share;
            for (j = k + 1; j < @N@_STATES; ++j) {
                m->matrix[i][j] -= share * m->matrix[k][j];
            }
        }
    }
    return @N@_OK;
}

static void solve(const @n@_machine *m, real *x) {
    int i, j;
    for (i = 0; i < @N@_STATES; ++i) {
        const real kept = x[i];
        x[i] = x[m->exchanged[i]];
        x[m->exchanged[i]] = kept;
    }
    for (i = 0; i < @N@_STATES; ++i) {
        for (j = 0; j < i; ++j) {
            x[i] -= m->matrix[i][j] * x[j];
        }
    }
    for (i = @N@_STATES - 1; i >= 0; --i) {
        for (j = i + 1; j < @N@_STATES; ++j) {
            x[i] -= m->matrix[i][j] * x[j];
        }
        x[i] /= m->matrix[i][i];
    }
}

/* One step of the method from where the machine is, brought to the constraints. */
static int advance(@n@_machine *m, real t, const real *y, real h, real *next) {
    int s, i, j;
    int status = factor(m, h);
#if SWITCHES > 0
    memcpy(m->last, m->first, sizeof m->last);
#endif
    for (s = 0; s < STAGES && status == @N@_OK; ++s) {
        for (i = 0; i < @N@_STATES; ++i) {
            real sum = R(0.0);
            for (j = 0; j < s; ++j) {
                sum += method_a[s][j] * m->slopes[j][i];
            }
            m->stage[i] = y[i] + sum;
        }
        status = @n@_rates(m, t + method_c[s] * h, m->stage, m->slopes[s]);
#if SWITCHES > 0
        reach(m, t + method_c[s] * h, m->stage);
#endif
        for (i = 0; i < @N@_STATES && status == @N@_OK; ++i) {
            real sum = R(0.0);
            for (j = 0; j < s; ++j) {
                sum += method_coupling[s][j] * m->slopes[j][i];
            }
            m->slopes[s][i] += sum / h + method_times[s] * h * m->by_time[i];
        }
        solve(m, m->slopes[s]);
    }
    if (status != @N@_OK) {
        return status;
    }
    for (i = 0; i < @N@_STATES; ++i) {
        real sum = R(0.0);
        for (j = 0; j < STAGES; ++j) {
            sum += method_b[j] * m->slopes[j][i];
        }
        next[i] = y[i] + sum;
    }
    return @n@_project(m, t + h, next);
}
