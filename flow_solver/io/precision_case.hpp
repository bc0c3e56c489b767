#pragma once

#include "coupler/base/case_reader.hpp"
#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Key `precision` of [flow.numerics].
void read_precision(Section& numerics, Precision& precision);

/// Where the case on the command line asks for the other precision, puts its program, which lies
/// beside this one, in this one's place: the process stays the same for whoever started it. Before
/// MPI starts and before anything is said. Returns where this program is the right one, where the
/// other one is missing, and for whatever is wrong with command line or case, which the run itself
/// then tells.
void become_asked_precision(int argc, char** argv) noexcept;

/// Throws CaseError where the case asks for the precision of the program that could not be started.
void require_own_precision(Precision asked);

}  // namespace ocublast::flow
