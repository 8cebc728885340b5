!> The paper's heavy top (section 4.3): V = u0 . Q e3 with |u0| = 1e-3, so the motion stays close to that of
!> the free body. 100 000 steps of h = 0.5 with the paper's scheme of order 6 and the exact free flow.
program scene1_papers_top
    use frb, only: wp, rigid_body, heavy_top, splitting_scheme, integrate, invariant_monitor
    implicit none
    type(rigid_body) :: body
    type(heavy_top) :: top
    type(invariant_monitor) :: monitor
    real(wp) :: m(3), q(4), t

    body = rigid_body([1.0_wp, 1.0126869887825154_wp, 3.3062374224730378_wp])
    top%force = [9.5586303547238536e-05_wp, 4.8777318247201465e-04_wp, -8.6772148817192390e-04_wp]
    m = [-3.4790957088547336e-01_wp, -1.9822914599675923e-01_wp, -9.1633189192763642e-01_wp]
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    t = 0.0_wp

    monitor%body = body
    allocate (monitor%scene, source=top)
    monitor%axis = top%force/norm2(top%force)

    call integrate(body, splitting_scheme('srkn14'), top, 0.5_wp, 100000, m, q, monitor, t=t)

    print '(a,f8.1,a,3f9.5)', 't = ', t, '   m = ', m
    print '(a,l2)', 'energy within 1e-13 throughout:                ', monitor%energy_error < 1.0e-13_wp
    print '(a,l2)', 'momentum about the force within 2e-13:          ', monitor%momentum_error < 2.0e-13_wp
    print '(a,l2)', 'attitude of norm one within 2e-13:              ', monitor%norm_error < 2.0e-13_wp
end program scene1_papers_top

! Output:
!   t =  50000.0   m =   0.39826  0.00666 -0.91670
!   energy within 1e-13 throughout:                 T
!   momentum about the force within 2e-13:           T
!   attitude of norm one within 2e-13:               T
