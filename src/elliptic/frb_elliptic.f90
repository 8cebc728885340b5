!> Elliptic integrals and functions under the short names of the literature: `use frb_elliptic, only: rf`.
!> The module `frb` has them under names that leave a user's `rc` and `jacobi` alone.
module frb_elliptic
    use frb_agm, only: ellip_k, ellip_f, jacobi_am, jacobi, landen_step
    use frb_carlson, only: rf, rc, rj, rd
    use frb_legendre, only: ellpi, ellint_pi, ellint_pi_between
    use frb_quadrature, only: gauss_legendre, eint_gauss
    implicit none
    public

end module frb_elliptic
