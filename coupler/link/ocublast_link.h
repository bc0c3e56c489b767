/* A participant of a coupled run in C: the same as coupler/link/participant.hpp, for C, Fortran and
 * whatever can call C. All quantities in SI units; arrays of doubles, [n, 3] or [n], row by row. A
 * function that fails returns 0 (or NULL); ocu_error then says why, and the coupler has been told.
 * Calls come in this order: ocu_connect; solid: ocu_send_mesh, flow: ocu_mesh; ocu_ready; while
 * ((order = ocu_next(p)) && order->kind != OCU_FINISH) ... ; ocu_goodbye; ocu_close
 */
#ifndef OCUBLAST_LINK_H
#define OCUBLAST_LINK_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct ocu_participant ocu_participant;

enum ocu_role { OCU_FLOW = 0, OCU_SOLID = 1 };
enum ocu_kind { OCU_STEP = 0, OCU_CHECKPOINT = 1, OCU_FINISH = 2 };

/* What the coupler asks. Pointers stay valid until the next call of ocu_next. */
typedef struct ocu_order {
  int kind;              /* enum ocu_kind */
  uint64_t window;       /* 1, 2, ... */
  double t_begin, t_end; /* s; end the window at exactly t_end */
  uint32_t steps;        /* steps to take, 0: as many as stability needs */
  int load_linear; /* solid: from the last window's load to this one; else this one throughout */
  int wall_cubic;  /* flow: cubic path through positions and velocities; else straight */
  uint32_t
      iteration; /* 0: explicit; 1: keep the state before; > 1: begin the window again from it */
  int wants_acceleration; /* solid: report accelerations too */
  int idle;               /* flow: wall at rest where it was; solid: load zero; no arrays then */
  const double* position; /* flow: [n, 3] m at t_end */
  const double* velocity; /* flow: [n, 3] m/s at t_end */
  const double* overpressure; /* solid: [n] Pa at t_end */
  const char* checkpoint;     /* OCU_CHECKPOINT: existing folder to write solid.* or flow.* into */
  const double* force; /* solid after ocu_take_forces: [n, 3] N at t_end, instead of overpressure */
} ocu_order;

/* What a participant says of a window it has done. NULL where there is nothing. */
typedef struct ocu_report {
  int idle; /* flow: load exactly zero; solid: nothing has moved */
  const double *position, *velocity, *acceleration; /* solid: [n, 3] at t_end */
  const double* overpressure;                       /* flow: [n] at t_end */
  double stable_step; /* s, > 0: largest step of its own it can take next */
  uint32_t steps_taken;
  double work;            /* J, done on the solid in the window */
  double impulse[3];      /* N s, given to the solid */
  double impedance;       /* flow: kg/(m^2 s), largest rho c at the wall */
  double mass_per_area;   /* solid: kg/m^2, smallest that waves reach in a window */
  double compute_seconds; /* s of wall time */
  const double*
      balance; /* flow with several solids: [n_meshes, 4] work J, impulse N s given to each */
} ocu_report;

/* Connects to the coupler that started this program (environment). NULL on failure, see
 * ocu_error(NULL). case_hash: 0 takes that of the environment. */
ocu_participant* ocu_connect(int role, const char* program, uint64_t case_hash);
int ocu_send_mesh(ocu_participant* p, const char* name, size_t n_vertices, const double* vertices,
                  size_t n_triangles, const int32_t* triangles);
/* Flow: the solid's mesh; its arrays live as long as the participant. */
int ocu_mesh(ocu_participant* p, size_t* n_vertices, const double** vertices, size_t* n_triangles,
             const int32_t** triangles);
/* Flow, instead, with several solids: their meshes. Orders and reports hold the values of all, one
 * after the other. */
int ocu_receive_meshes(ocu_participant* p, size_t* n_meshes);
int ocu_mesh_of(ocu_participant* p, size_t k, const char** name, size_t* n_vertices,
                const double** vertices, size_t* n_triangles, const int32_t** triangles);
/* Solid, before ocu_ready: where the flow has a mesh of its own, forces at the vertices may come.
 */
int ocu_take_forces(ocu_participant* p);
/* Set-up is done. window and time where it resumed, 0 and 0.0 when fresh; velocity: initial, or
 * NULL. */
int ocu_ready(ocu_participant* p, double stable_step, uint64_t window, double time,
              const double* velocity);
const ocu_order* ocu_next(ocu_participant* p);
int ocu_send(ocu_participant* p, const ocu_report* report);
int ocu_checkpoint_written(ocu_participant* p);
int ocu_goodbye(ocu_participant* p);
void ocu_abort(ocu_participant* p, const char* reason, int exit_code);
void ocu_close(ocu_participant* p);
/* Why the last call failed; never NULL. p NULL: of ocu_connect, in this thread. */
const char* ocu_error(const ocu_participant* p);

#ifdef __cplusplus
}
#endif
#endif
