#pragma once

namespace ocublast::solid {

/// The whole program: reads the case, runs alone or as the solid side of a coupled run. Returns the
/// exit code of a good end; throws CaseError, LinkError or NumericsError.
int run_program(int argc, char** argv);

}  // namespace ocublast::solid
