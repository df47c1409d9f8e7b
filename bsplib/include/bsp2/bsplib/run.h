/* Runs: the newest put, hpput, get, hpget and message to a rank, as long as the next call can continue them.
 *
 * A loop over neighbouring places is one access in many calls, a loop over messages of one size is one
 * record. What continues a run is compiled into the program, from here, and so is a put of one word that goes
 * elsewhere in the same memory; everything else goes to the library, which ends the run and begins another
 * one. Not an interface for programs. */
#ifndef BSP2_BSPLIB_RUN_H
#define BSP2_BSPLIB_RUN_H

#include <stddef.h>

#ifdef __GNUC__
#define BSP2_INLINE extern __inline__ __attribute__((__always_inline__, __gnu_inline__))
#define BSP2_COPY __builtin_memcpy
#define BSP2_LINE __attribute__((__aligned__(64))) /* one cache line each */
#define BSP2_RARELY(condition) __builtin_expect(!!(condition), 0)
#else
#include <string.h>
#define BSP2_INLINE static inline
#define BSP2_COPY memcpy
#define BSP2_LINE
#define BSP2_RARELY(condition) (condition)
#endif

/* The process that we write to has read this memory in an earlier superstep. Small writes would wait for
 * every cache line to come back from it; __builtin_prefetch does not ask for the right to write, unless told
 * the processor. */
#if defined(__GNUC__) && defined(__x86_64__)
/* Aligned: a loop with one that lies across two blocks of 32 bytes of instructions takes up to 2.4 times as
 * long (Zen 5). */
#define BSP2_SOON_WRITTEN(place) __asm__ __volatile__(".p2align 3\n\tprefetchw %0" : : "m"(place))
#elif defined(__GNUC__)
#define BSP2_SOON_WRITTEN(place) __builtin_prefetch(&(place), 1)
#else
#define BSP2_SOON_WRITTEN(place) ((void)0)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Of buffered puts: each call appends its bytes to the stream. Where they go follows from the offset alone,
 * so calls do not wait for each other. Zeros are a run that nothing continues. */
struct bsp2_put_run {
  const void* name; /* the address by which a classic program knows the memory; NULL: none */
  size_t next;      /* where the run ends in the registration */
  size_t end;       /* how far it may go; 0: not at all, then next is 0, too */
  size_t origin; /* address in the stream that offset 0 would have; if `end` is 0, that of the next record */
  unsigned slot; /* number of its registration; all ones: none */
  /* Of puts of 8 bytes to the same registration that do not continue the newest one, while `end` is 0: */
  unsigned head;  /* of their records, beside the offset */
  size_t last;    /* where the newest put ends: one there begins a run */
  size_t limit;   /* offsets are below this */
  size_t ceiling; /* records begin below this address; 0: none can */
} BSP2_LINE;

/* Of the others: nothing is copied before the run ends, calls only prolong it. */
struct bsp2_reference_run {
  const void* name;
  size_t next;
  size_t end;
  const char* origin; /* where offset 0 would be in the memory of this rank */
  size_t first;       /* where it began in the registration */
  unsigned slot;
  unsigned pieced; /* whether it began with a small call */
} BSP2_LINE;

/* Of messages to one queue with tags and payloads of one size: each call appends both to the stream. */
struct bsp2_message_run {
  char* next;
  char* ceiling;  /* messages begin below this address; NULL, as next: nothing continues the run */
  size_t payload; /* bytes, as in `tag` */
  size_t tag;
  size_t tag_room; /* the same, padded to 8 bytes */
  size_t ahead; /* how far a message is from its payload, if these lie one after the other (bsp2_is_ahead) */
} BSP2_LINE;

/* Tables by rank. One a kind: the fields are then near the start of what a loop works on, its instructions
 * shorter. */
struct bsp2_runs {
  struct bsp2_put_run* put;
  struct bsp2_reference_run *hpput, *get, *hpget;
  struct bsp2_message_run* send;
};

/* The messages of one size at the front of the queue of a classic program. Tag and payload follow each other,
 * both padded to 8 bytes. */
struct bsp2_messages {
  const char* place; /* of the first one; NULL: the queue is empty */
  const char* last;  /* of the last one */
  size_t payload, payload_room;
  size_t tag, tag_room;
  size_t ahead; /* bsp2_is_ahead */
};

/* Whether there are bytes, and all are before the end; from <= end. The end is that of memory, so a size
 * known to be small can be added to it. */
BSP2_INLINE int bsp2_fits(size_t from, size_t bytes, size_t end) {
#ifdef __GNUC__
  if (__builtin_constant_p(bytes) && bytes - 1 < 4096) return from + bytes <= end;
#endif
  return bytes - 1 < end - from;
}

/* The stream holds words of a type that the compiler keeps apart from what runs consist of, so a write to it
 * does not make it read a program's own variables again. */
#ifdef __GNUC__
__extension__ typedef unsigned long long bsp2_word __attribute__((__aligned__(1)));
#define BSP2_COPY_WORD(place, source) (*(bsp2_word*)(place) = bsp2_word_at(source))
BSP2_INLINE bsp2_word bsp2_word_at(const void* source) {
  bsp2_word word;
  BSP2_COPY(&word, source, sizeof word);
  return word;
}
#else
#define BSP2_COPY_WORD(place, source) BSP2_COPY(place, source, 8)
#endif

/* Where the size is not known, the compiler must not conclude from a branch for one size that smaller memory
 * is accessed, and warn the programmer of it. */
#ifdef __GNUC__
#define BSP2_HIDE(pointer) __asm__("" : "+r"(pointer))
#define BSP2_IS_KNOWN(size) __builtin_constant_p(size)
#else
#define BSP2_HIDE(pointer) ((void)0)
#define BSP2_IS_KNOWN(size) 1
#endif

/* In the library: for 2 KiB and more, where memcpy is slow for some places (copy.hpp). */
void bsp2_copy_much(char* place, const void* source, size_t bytes);

BSP2_INLINE void bsp2_copy_part(char* place, const void* source, size_t bytes) {
  if (!BSP2_IS_KNOWN(bytes)) {
    BSP2_HIDE(place);
    BSP2_HIDE(source);
  }
  if (bytes == 8) {
    BSP2_COPY_WORD(place, source);
  } else if (!BSP2_IS_KNOWN(bytes) && bytes == 4) {
    BSP2_COPY(place, source, 4);
  } else if (bytes >= 2048) {
    bsp2_copy_much(place, source, bytes);
  } else {
    BSP2_COPY(place, source, bytes);
  }
}

/* Both return whether the call is done. held, named: what tells the memory of the run and that of the call. A
 * call costs about three cycles: what is compared comes from memory by itself, and the processor joins each
 * comparison with its branch. */
BSP2_INLINE int bsp2_continue_put(struct bsp2_put_run* run, size_t held, size_t named, size_t offset,
                                  const void* source, size_t bytes) {
  char* place;
  if (BSP2_RARELY(offset != run->next)) return 0;
  if (BSP2_RARELY(held != named)) return 0;
  if (BSP2_RARELY(!bsp2_fits(offset, bytes, run->end))) return 0;
  if (BSP2_RARELY(source == 0)) return 0;
  place = (char*)(run->origin + offset);
  BSP2_SOON_WRITTEN(place[1024]);
  bsp2_copy_part(place, source, bytes);
  run->next = offset + bytes;
  return 1;
}

/* A put of one word elsewhere in the memory that the newest put goes to: a record of its own. */
BSP2_INLINE int bsp2_scatter_put(struct bsp2_put_run* run, size_t held, size_t named, size_t offset,
                                 const void* source, size_t bytes) {
#ifdef __GNUC__
  const size_t place = run->origin;
  if (bytes != 8) return 0;
  if (BSP2_RARELY(held != named)) return 0;
  if (BSP2_RARELY(place >= run->ceiling)) return 0;
  if (BSP2_RARELY(offset >= run->limit)) return 0;
  if (BSP2_RARELY(offset == run->last)) return 0;
  if (BSP2_RARELY(source == 0)) return 0;
  if (!BSP2_IS_KNOWN(bytes)) BSP2_HIDE(source);
  BSP2_SOON_WRITTEN(((char*)place)[1024]);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  *(bsp2_word*)place = (bsp2_word)run->head << 32 | offset;
#else
  *(bsp2_word*)place = (bsp2_word)offset << 32 | run->head;
#endif
  BSP2_COPY_WORD(place + 8, source);
  run->origin = place + 16;
  run->last = offset + 8;
  return 1;
#else
  return 0; /* the library can do it, too */
#endif
}

BSP2_INLINE size_t bsp2_padded(size_t bytes) { return (bytes + 7) & ~(size_t)7; }

/* Each message begins where a call before has said, in memory, that the last one ends, and would wait for
 * that. But in a loop over neighbouring elements it is always as far from the program's own memory `other`,
 * which the processor knows at once. So the place is foreseen, and what was read is only compared. Returns
 * whether it is so; *place is then the foreseen one. */
BSP2_INLINE int bsp2_is_ahead(size_t ahead, const char** place, const void* other) {
#ifdef __GNUC__
  const size_t guess = (size_t)other + ahead;
  size_t foreseen = guess;
  __asm__("" : "+r"(foreseen)); /* else the compiler would take the place itself where both are equal */
  if (guess != (size_t)*place) return 0;
  *place = (const char*)foreseen;
  return 1;
#else
  (void)ahead, (void)place, (void)other;
  return 0;
#endif
}

/* The run goes on to the same queue. Messages without a byte, and mistakes, are the library's. */
BSP2_INLINE int bsp2_continue_messages(struct bsp2_message_run* run, const void* tag, const void* payload,
                                       size_t bytes) {
  char* place = run->next;
  const size_t tag_room = run->tag_room;
  if (BSP2_RARELY(bytes != run->payload)) return 0;
  if (BSP2_RARELY(place >= run->ceiling)) return 0;
  if (BSP2_RARELY(payload == 0)) return 0;
  bsp2_is_ahead(run->ahead, (const char**)&place, payload);
  BSP2_SOON_WRITTEN(place[1024]);
  if (tag_room > 0) {
    if (BSP2_RARELY(tag == 0)) return 0;
    bsp2_copy_part(place, tag, run->tag);
    place += tag_room;
  }
  bsp2_copy_part(place, payload, bytes);
  run->next = place + bsp2_padded(bytes);
  return 1;
}

BSP2_INLINE int bsp2_continue_reference(struct bsp2_reference_run* run, size_t held, size_t named,
                                        size_t offset, const void* local, size_t bytes) {
  if (BSP2_RARELY(offset != run->next)) return 0;
  if (BSP2_RARELY(held != named)) return 0;
  /* As numbers: where offset 0 would be is not always memory of the program, and local may be NULL. */
  if (BSP2_RARELY((size_t)local - offset != (size_t)run->origin)) return 0;
  if (BSP2_RARELY(!bsp2_fits(offset, bytes, run->end))) return 0;
  run->next = offset + bytes;
  return 1;
}

#ifdef __cplusplus
}
#endif

#endif
