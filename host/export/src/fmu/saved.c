
/* ---- states that are saved and restored ---- */

/* What begins the bytes of a saved state, so that those of another machine are refused. */
static const char saved_tag[16] = "@tag@";
#define SAVED_SIZE (sizeof saved_tag + sizeof(content))

static int deserialise(instance *it, const void *bytes, size_t size, void **state) {
    if (size != SAVED_SIZE || memcmp(bytes, saved_tag, sizeof saved_tag) != 0) {
        say(it, ERROR, "the bytes are not a state of this machine");
        return 0;
    }
    if (*state == NULL) {
        *state = malloc(sizeof(content));
    }
    if (*state == NULL) {
        return 0;
    }
    memcpy(*state, (const char *)bytes + sizeof saved_tag, sizeof(content));
    return 1;
}

static int serialise(const void *state, void *bytes, size_t size) {
    if (size < SAVED_SIZE) {
        return 0;
    }
    memcpy(bytes, saved_tag, sizeof saved_tag);
    memcpy((char *)bytes + sizeof saved_tag, state, sizeof(content));
    return 1;
}

static int save(const instance *it, void **state) {
    if (*state == NULL) {
        *state = malloc(sizeof(content));
    }
    if (*state == NULL) {
        return 0;
    }
    memcpy(*state, &it->now, sizeof(content));
    return 1;
}
