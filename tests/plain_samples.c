/* libbuild/samples.c once more, without vectors: see plain_tree.h. */
#define SPB_NO_VECTORS
#include "plain_tree.h"
#include "samples.c"
