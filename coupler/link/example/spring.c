/* A piston on a spring as a solid solver in C: the whole of it. Build: see CMakeLists.txt beside this file. */
#include <math.h>
#include <ocublast_link.h>
#include <stdio.h>

#define N 4
static const double mass = 5.0, stable_step = 0.005, phase = 1.0, amplitude = 1e-6; /* per m^2 */
static const double face[3 * N] = {1, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1};
static const int32_t triangles[6] = {0, 2, 1, 1, 2, 3};

typedef struct { double d, v, p, time, window; } State;

static double spring(double omega) { return mass * omega * omega - sqrt(1.4) * omega / tan(phase); }

/* Velocity Verlet under a load that is linear in the window; returns the work. */
static double advance(State *s, const ocu_order *o, double p_end, double K) {
  const double dt = (o->t_end - o->t_begin) / o->steps, p0 = o->load_linear ? s->p : p_end;
  double work = 0.0;
  for (uint32_t k = 0; k < o->steps; ++k) {
    const double pa = p0 + (p_end - p0) * k / o->steps, pb = p0 + (p_end - p0) * (k + 1) / o->steps;
    const double half = s->v + 0.5 * dt * (pa - K * s->d) / mass, before = s->d;
    s->d += dt * half;
    s->v = half + 0.5 * dt * (pb - K * s->d) / mass;
    work += 0.5 * (pa + pb) * (s->d - before);
  }
  s->p = p_end, s->time = o->t_end, s->window = (double)o->window;
  return work;
}

int main(void) {
  const double omega = phase * sqrt(1.4), K = spring(omega);
  State s = {0.0, amplitude * sin(phase) * omega, 0.0, 0.0, 0.0}, begin = s;
  double x[3 * N], v[3 * N] = {0};
  ocu_participant *p = ocu_connect(OCU_SOLID, "spring.c 1", 0);
  if (!p) return fprintf(stderr, "%s\n", ocu_error(NULL)), 3;
  for (int i = 0; i < N; ++i) v[3 * i] = s.v;
  const ocu_order *o = NULL;
  if (ocu_send_mesh(p, "piston", N, face, 2, triangles) && ocu_ready(p, stable_step, 0, 0.0, v))
    while ((o = ocu_next(p)) && o->kind == OCU_STEP) {
      if (o->iteration == 1) begin = s;
      if (o->iteration > 1) s = begin;
      const double p_before = s.p, p_end = o->overpressure ? o->overpressure[0] : 0.0;
      const double work = advance(&s, o, p_end, K);
      for (int i = 0; i < 3 * N; ++i) x[i] = face[i] + (i % 3 == 0 ? s.d : 0.0), v[i] = i % 3 == 0 ? s.v : 0.0;
      const ocu_report r = {.position = x, .velocity = v, .stable_step = stable_step, .steps_taken = o->steps,
                            .work = work, .impulse = {0.5 * (p_before + p_end) * (o->t_end - o->t_begin)},
                            .mass_per_area = mass};
      if (!ocu_send(p, &r)) break;
    }
  const int good = o && o->kind == OCU_FINISH && ocu_goodbye(p);
  if (o && o->kind == OCU_CHECKPOINT) ocu_abort(p, "this example writes no checkpoints", 1);
  if (!good) fprintf(stderr, "%s\n", ocu_error(p));
  ocu_close(p);
  return good ? 0 : 3;
}
