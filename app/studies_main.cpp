// The program `knuckle-studies`: what judges Knuckle. Nothing that runs a machine is linked with it.
#include "app/audit/audit_files.h"
#include "app/cli/command.h"
#include "app/operators/study.h"
#include "app/pairing/key_folder.h"
#include "app/studies/papers.h"
#include "app/studies/sweep.h"

int main(int argc, char** argv) {
  return knuckle::cli::run_program(
      {"knuckle-studies",
       "Judges Knuckle: many sampled machines, the papers it is based on, persons at work.\n",
       "Try: knuckle-studies sweep --battery estimation --machines 2 --ensemble 0\n",
       {knuckle::operators::operators_entry(), knuckle::studies::papers_entry(), knuckle::studies::sweep_entry()},
       {knuckle::pairing::kept_name, knuckle::audit::kept_name}},
      {argv + 1, argv + argc});
}
