#include "app/knuckle_program.h"

int main(int argc, char** argv) {
  return knuckle::cli::run_program(knuckle::knuckle_program(), {argv + 1, argv + argc});
}
