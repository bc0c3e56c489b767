#pragma once

#include "coupler/base/ranks.hpp"

namespace ocublast::solid {

/// The whole program: reads the case, runs alone or as the solid side of a coupled run, on one rank
/// or several (every rank calls it; the root speaks). Returns the exit code of a good end; throws
/// CaseError, LinkError or NumericsError.
int run_program(int argc, char** argv, const Ranks& ranks);

}  // namespace ocublast::solid
