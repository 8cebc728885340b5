! A user's own variables with the short names of elliptic functions, beside all names of the library.
program short_names
    use frb
    implicit none
    real(wp) :: rc, rf, rd, rj, jacobi

    rc = 1.0_wp
    rf = 1.0_wp
    rd = 2.0_wp
    rj = 3.0_wp
    jacobi = carlson_rf(rc, rf, 1.0_wp) + carlson_rc(rc, rf) + rd + rj
    if (abs(jacobi - 7) > 1.0e-14_wp) error stop 1
end program short_names
