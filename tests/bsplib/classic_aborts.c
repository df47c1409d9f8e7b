/* Mistakes that must end all processes, each with its message: classic_aborts <case>. A case that gets to the
 * end has failed, since this program then succeeds. */
#include <bsp.h>
#include <bsp_level1.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char* wanted;
static int value;

static int is(const char* name) { return strcmp(wanted, name) == 0; }

static void vabort(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  bsp_vabort(format, arguments);
}

/* Accesses of no bytes: the process and the offset must be right all the same. */
static void nothing(bsp_pid_t pid, bsp_size_t offset) {
  int here = 0;
  bsp_push_reg(&value, 4);
  bsp_sync();
  bsp_put(0, &here, &value, 4, 0); /* these are */
  bsp_hpput(0, &here, &value, 4, 0);
  bsp_get(0, &value, 4, &here, 0);
  bsp_hpget(0, &value, 4, &here, 0);
  if (strstr(wanted, "_put_")) bsp_put(pid, &here, &value, offset, 0);
  if (strstr(wanted, "_hpput_")) bsp_hpput(pid, &here, &value, offset, 0);
  if (strstr(wanted, "_get_")) bsp_get(pid, &value, offset, &here, 0);
  if (strstr(wanted, "_hpget_")) bsp_hpget(pid, &value, offset, &here, 0);
  bsp_sync();
}

static void spmd_without_end(void) { bsp_begin(bsp_nprocs()); }

static void never_reached(void) {
  bsp_begin(bsp_nprocs());
  bsp_end();
}

static void registrations(int me, int other) {
  int second;
  if (is("push_negative")) bsp_push_reg(&value, -1);
  if (is("push_some") && me != 1) bsp_push_reg(&value, 4);
  if (is("pop_unknown")) bsp_pop_reg(&value);
  if (is("pop_null")) bsp_pop_reg(NULL);
  if (is("pop_other")) {
    bsp_push_reg(&value, 4);
    bsp_push_reg(&second, 4);
    bsp_pop_reg(me == 0 ? &value : &second);
  }
  if (is("push_pop_order")) {
    bsp_push_reg(&value, 4);
    if (me == 0) bsp_pop_reg(&value);
    bsp_push_reg(&second, 4);
    if (me != 0) bsp_pop_reg(&value);
  }
  if (is("pop_some")) {
    bsp_push_reg(&value, 4);
    bsp_sync();
    if (me == 0) bsp_pop_reg(&value);
  }
  if (is("put_after_pop")) {
    bsp_push_reg(&value, 4);
    bsp_pop_reg(&value);
    bsp_sync();
    bsp_put(other, &me, &value, 0, 4);
  }
  if (is("put_unregistered")) bsp_put(other, &me, &value, 0, 4);
  if (is("put_before_sync")) {
    bsp_push_reg(&value, 4);
    bsp_put(other, &me, &value, 0, 4);
  }
  if (is("put_to_null")) {
    bsp_push_reg(me == 1 ? NULL : &value, 4);
    bsp_sync();
    if (me == 0) bsp_put(1, &me, &value, 0, 4);
  }
}

static void accesses(int me, int p) {
  int two[2] = {0, 0};
  bsp_push_reg(&value, 4);
  bsp_sync();
  if (is("put_nprocs")) bsp_put(p, &me, &value, 0, 4);
  if (is("put_minus_one")) bsp_put(-1, &me, &value, 0, 4);
  if (is("put_beyond") && me == p - 1) bsp_put(0, two, &value, 0, 8);
  if (is("put_negative")) bsp_put(0, two, &value, -4, 4);
  if (is("put_null")) bsp_put(0, two, NULL, 0, 4);
  if (strstr(wanted, "_after_word")) { /* what the first one began may not let the second one through */
    static double words[4];
    double* all = words;
    bsp_push_reg(words, sizeof words);
    bsp_sync();
    bsp_put(0, words, words, 16, 8);
    bsp_put(0, words, words, 0, 8);
    if (is("put_null_after_word")) bsp_put(0, NULL, words, 8, 8);
    if (is("put_scattered_null_after_word")) bsp_put(0, NULL, words, 16, 8);
    if (is("put_negative_after_word")) bsp_put(0, words, words, -8, 8);
    if (is("put_beyond_after_word")) bsp_put(0, all, words, 25, 8);
    if (is("put_nobody_after_word")) bsp_put(p, words, words, 24, 8);
  }
  if (is("hpput_beyond")) bsp_hpput(0, two, &value, 1, 4);
  if (is("get_beyond")) bsp_get(0, &value, 4, two, 4);
  if (is("hpget_beyond")) bsp_hpget(0, &value, 0, two, 8);
  if (is("direct_get_beyond")) bsp_direct_get(0, &value, 0, two, 8);
  bsp_sync();
}

static void messages(int me, int p) {
  bsp_size_t size = (bsp_size_t)me;
  if (is("tagsize_some") && me == 0) bsp_set_tagsize(&size);
  if (is("tagsize_differs")) bsp_set_tagsize(&size);
  size = (bsp_size_t)-1;
  if (is("tagsize_negative")) bsp_set_tagsize(&size);
  if (is("tagsize_null")) bsp_set_tagsize(NULL);
  if (is("qsize_null")) bsp_qsize(NULL, NULL);
  if (is("send_nobody")) bsp_send(p, NULL, NULL, 0);
#ifdef BSP2_MULTICORE_BSP
  if (is("send_too_much")) bsp_send((bsp_pid_t)me, NULL, &value, (size_t)1 << 62);
#endif
  if (strstr(wanted, "_after_message")) {
    bsp_send(me, NULL, &value, 4);
    if (is("send_null_after_message")) bsp_send(me, NULL, NULL, 4);
    if (is("send_negative_after_message")) bsp_send(me, NULL, &value, size - 3);
    if (is("send_nobody_after_message")) bsp_send(-1, NULL, &value, 4);
    bsp_send(me, NULL, &value, 4);
    bsp_sync();
    bsp_move(&value, 4);
    if (is("move_null_after_message")) bsp_move(NULL, 4);
    bsp_move(&value, 4);
    if (is("move_after_message")) bsp_move(&value, 4);
  }
  if (is("get_tag_null")) bsp_get_tag(NULL, NULL);
  if (is("hpmove_null")) bsp_hpmove(NULL, NULL);
  if (is("move_empty")) bsp_move(NULL, 0);
}

static void first(void* result, void* left, void* right, int* nbytes) {
  (void)right;
  memcpy(result, left, (size_t)*nbytes);
}

static void collectives(int me, int p) {
  void (*none)(void*, void*, void*, int*) = NULL;
  int all[64] = {0};
  if (is("level1_root")) bsp_bcast(p, &me, all, 4);
  if (is("level1_negative")) bsp_fold(first, &me, all, -1);
  if (is("level1_null")) bsp_scan(none, &me, all, 4);
  if (is("level1_roots_differ")) bsp_bcast(me == 1 ? 1 : 0, &me, all, 4);
  if (is("level1_sizes_differ")) bsp_fold(first, &me, all, me == 1 ? 1 : 4);
  if (is("level1_or_sync")) {
    if (me == 1) bsp_sync();
    bsp_gather(0, &me, all, 4);
  }
}

int main(int argc, char** argv) {
  int me, p;
  wanted = argc > 1 ? argv[1] : "";
  if (is("never_began")) {
    bsp_init(never_reached, argc, argv);
    return 0; /* process 0 forgets to begin, the others wait in bsp_begin */
  }
  if (is("spmd_without_end")) {
    bsp_init(spmd_without_end, argc, argv);
    spmd_without_end();
    return 0;
  }
  if (is("outside")) return bsp_pid();
  if (strncmp(wanted, "end_before_begin", 16) == 0) {
    bsp_nprocs(); /* starts MPI */
    if (strcmp(getenv("OMPI_COMM_WORLD_RANK"), "1") == 0) return is("end_before_begin") ? 0 : 1;
  }
  bsp_begin(is("begin_nobody") ? 0 : bsp_nprocs());
  me = bsp_pid();
  p = bsp_nprocs();
  if (is("abort")) bsp_abort("the answer is %d", 42);
  if (is("abort_null")) bsp_abort(NULL);
  if (is("vabort")) vabort("%s: the answer is %d", "vabort", 42);
  if (is("vabort_null")) vabort(NULL);
  if (is("vabort_one_rank") && me == 1) vabort("only process %d\n", me);
  if (is("abort_one_rank") && me == 1) bsp_abort("only process %d\n", me);
  if (is("begin_twice")) bsp_begin(1);
  if (is("end_early") && me != 1) bsp_sync();
  if (is("end_late") && me != 0) bsp_sync();
  if (is("exit_early") && me == p - 1) exit(0);
  if (is("exit_early") || is("abort_one_rank") || is("vabort_one_rank")) bsp_sync();
  registrations(me, (me + 1) % p);
  if (strncmp(wanted, "put_", 4) == 0 || strstr(wanted, "_beyond")) accesses(me, p);
  if (strncmp(wanted, "nothing_", 8) == 0)
    nothing(strstr(wanted, "_nprocs")      ? p
            : strstr(wanted, "_minus_one") ? -1
                                           : 0,
            strstr(wanted, "_negative") ? -4 : 0);
  messages(me, p);
  collectives(me, p);
  if (!is("end_early") && !is("end_late")) bsp_sync();
  bsp_end();
  return 0;
}
