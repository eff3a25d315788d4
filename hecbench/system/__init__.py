"""Files written whole or not at all, the decoder of pictures, the cache of the user, threads."""
