!> The chart `tangent`: error of the derivative of a step by the momentum, J = dm'/dm and W = dtheta'/dm,
!> against closeness to every place where methods are known to fail; central differences and dual numbers
!> beside `flow_tangent`, with their cost.
module frb_chart_tangent
    use frb, only: wp, flow_tangent, free_flow, quat_conjugate, quat_product, rigid_body
    use frb_chart_failure, only: panels, names, distances, new_failure_case, failed, begin_panels, &
        begin_panel, begin_legend
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, say, &
        either
    use frb_chart_truth, only: free_case
    use frb_dual_steps, only: dual_step, points
    use frb_elliptic, only: gauss_legendre
    use frb_taylor_truth, only: qp, long_truth
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_tangent

    integer, parameter :: rivals = 3
    character(*), parameter :: keys(rivals) = [character(20) :: 'flow_tangent', 'central differences', &
                                               'dual numbers']
    character(*), parameter :: colours(rivals) = [character(9) :: '"#0072B2"', '"#D55E00"', '"#009E73"']
    character(*), parameter :: legend(rivals) = [character(20) :: 'flow\\_tangent', keys(2:)]
    real(wp), parameter :: roundoff = epsilon(1.0_wp)/2, floor_of_scores = 1.0e-2_wp
    real(wp), parameter :: no_turn(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    !> Change of m in central differences, chosen for the smallest error; largest number of short steps of
    !> dual numbers.
    real(wp), parameter :: difference = 6.0e-6_wp
    integer, parameter :: most_steps = 20000

contains

    subroutine chart_tangent(options)
        type(settings), intent(in) :: options
        type(chart_file) :: file
        real(wp), allocatable :: distance(:), worst(:, :, :)
        real(wp) :: cost(rivals + 1)
        character(100) :: line
        integer :: p, k, c, i, per_point

        cost = costs()
        call open_table(options, 'tangent', &
                        'error of J and W in units of their inherent sensitivity, a block for '// &
                        'each place and method', &
                            'distance (0 drawn at 1e-17), largest score of J, of W; 1e18: NaN', file)
        write (file%line, '(a,f7.1,3(a,f5.1))') '# cost at h = 0.05: free_flow', cost(1), &
            ' ns; flow_tangent', &
            cost(2)/cost(1), ', central differences', cost(3)/cost(1), ', dual numbers', cost(4)/cost(1)
        call file%put(trim(file%line)//' times that')
        per_point = merge(1, 3, options%quick)
        do p = 1, panels
            distance = thinned(distances(p, options%quick), p)
            allocate (worst(2, rivals, size(distance)), source=0.0_wp)
            do k = 1, size(distance)
                do c = 1, per_point
                    call score(new_failure_case(p, distance(k), c), worst(:, :, k))
                end do
                if (maxval(worst(:, 1, k)) > 4.0_wp) then
                    write (line, '(a,es9.2,a,2es9.2)') '  '//names(p)//': at ', distance(k), ' scores ', &
                        worst(:, 1, k)
                    call say(trim(line))
                end if
                call progress(options, 'tangent', (p - 1)*size(distance) + k, panels*size(distance))
            end do
            do i = 1, rivals
                call file%put('# '//trim(names(p))//': '//trim(keys(i)))
                do k = 1, size(distance)
                    write (file%line, '(3es12.3)') max(distance(k), 1.0e-17_wp), worst(:, i, k)
                    call file%put()
                end do
                call file%end_block()
            end do
            deallocate (worst)
        end do
        call file%finish()
        call draw_tangent(options, cost)
    end subroutine chart_tangent

    !> Every other distance; steps up to 100.
    pure function thinned(values, panel) result(kept)
        real(wp), intent(in) :: values(:)
        integer, intent(in) :: panel
        real(wp), allocatable :: kept(:)

        kept = values(1::2)
        if (panel == panels) kept = pack(kept, kept <= 150.0_wp)
    end function thinned

    !> Raises the largest scores of J and W of all methods by those of a case.
    subroutine score(item, worst)
        type(free_case), intent(in) :: item
        real(wp), intent(inout) :: worst(2, rivals)
        real(qp) :: exact(6, 3)
        real(wp) :: got(6, 3, rivals), unit(2), errors(2)
        integer :: i

        call truth(item, exact, unit)
        got(:, :, 1) = by_tangent(item)
        got(:, :, 2) = by_differences(item)
        got(:, :, 3) = by_duals(item)
        do i = 1, rivals
            errors = real([norm2(got(1:3, :, i) - exact(1:3, :)), norm2(got(4:6, :, i) - exact(4:6, :))], &
                          wp)/unit
            where (.not. errors < failed) errors = failed
            worst(:, i) = max(worst(:, i), floor_of_scores, errors)
        end do
    end subroutine score

    !> J and W by differences of the Taylor series in quadruple precision, and 2^-53 of their norms with their
    !> change when each of the seven inputs grows by 2^-53.
    pure subroutine truth(item, exact, unit)
        type(free_case), intent(in) :: item
        real(qp), intent(out) :: exact(6, 3)
        real(wp), intent(out) :: unit(2)
        real(qp) :: inputs(7), moved(6, 3)
        integer :: i

        inputs = real([item%moments, item%m0, item%t], qp)
        exact = derivative(inputs)
        unit = roundoff*real([norm2(exact(1:3, :)), norm2(exact(4:6, :))], wp)
        do i = 1, 7
            inputs = real([item%moments, item%m0, item%t], qp)
            if (.not. abs(inputs(i)) > 0.0_qp) cycle
            inputs(i) = inputs(i)*(1 + real(roundoff, qp))
            moved = derivative(inputs) - exact
            unit = unit + real([norm2(moved(1:3, :)), norm2(moved(4:6, :))], wp)
        end do
    end subroutine truth

    pure function derivative(inputs) result(d)
        real(qp), intent(in) :: inputs(7)
        real(qp) :: d(6, 3)
        real(qp), parameter :: step = 1.0e-12_qp
        real(qp) :: m(3, 2), q(4, 2)
        integer :: k, side

        do k = 1, 3
            do side = 1, 2
                m(:, side) = inputs(4:6)
                m(k, side) = m(k, side) + (2*side - 3)*step
                q(:, side) = [1.0_qp, 0.0_qp, 0.0_qp, 0.0_qp]
                call long_truth(inputs(1:3), inputs(7), m(:, side), q(:, side))
            end do
            d(1:3, k) = (m(:, 2) - m(:, 1))/(2*step)
            ! 2 conj(q1) q2, the vector part
            d(4:6, k) = q(1, 1)*q(2:4, 2) - q(1, 2)*q(2:4, 1) &
                        - [q(3, 1)*q(4, 2) - q(4, 1)*q(3, 2), q(4, 1)*q(2, 2) - q(2, 1)*q(4, 2), &
                           q(2, 1)*q(3, 2) - q(3, 1)*q(2, 2)]
            d(4:6, k) = d(4:6, k)/step
        end do
    end function derivative

    function by_tangent(item) result(d)
        type(free_case), intent(in) :: item
        real(wp) :: d(6, 3)
        real(wp) :: m(3), q(4), transition(6, 6)

        m = item%m0
        q = no_turn
        call flow_tangent(rigid_body(item%moments), item%t, m, q, transition)
        d = transition(:, 1:3)
    end function by_tangent

    function by_differences(item) result(d)
        type(free_case), intent(in) :: item
        real(wp) :: d(6, 3)
        type(rigid_body) :: body
        real(wp) :: m(3, 2), q(4, 2), turn(4), step
        integer :: k, side

        body = rigid_body(item%moments)
        step = difference*norm2(item%m0)
        do k = 1, 3
            do side = 1, 2
                m(:, side) = item%m0
                m(k, side) = m(k, side) + (2*side - 3)*step
                q(:, side) = no_turn
                call free_flow(body, item%t, m(:, side), q(:, side))
            end do
            d(1:3, k) = (m(:, 2) - m(:, 1))/(2*step)
            turn = quat_product(quat_conjugate(q(:, 1)), q(:, 2))
            d(4:6, k) = turn(2:4)/step
        end do
    end function by_differences

    !> Short steps of dual numbers one after another: J = J2 J1, W = W2 J1 + E2 W1, E = J - m'^ W.
    function by_duals(item) result(d)
        type(free_case), intent(in) :: item
        real(wp) :: d(6, 3)
        type(rigid_body) :: body
        real(wp) :: m(3), moments(3), d2(6, 3), by_moments(6, 3), e2(3, 3), h, nodes(points), weights(points)
        integer :: steps, i, k

        body = rigid_body(item%moments)
        moments = item%moments
        steps = ceiling(min(abs(item%t)*norm2(item%m0)/(0.1_wp*minval(moments)), 1.0e9_wp))
        d = huge(d)
        if (steps > most_steps) return
        call gauss_legendre(points, nodes, weights)
        h = item%t/steps
        m = item%m0
        d = 0.0_wp
        do k = 1, 3
            d(k, k) = 1.0_wp
        end do
        do i = 1, steps
            call dual_step(moments, m, h, nodes, weights, d2, by_moments)
            call free_flow(body, h, m)
            do k = 1, 3
                e2(:, k) = d2(1:3, k) - [m(2)*d2(6, k) - m(3)*d2(5, k), m(3)*d2(4, k) - m(1)*d2(6, k), &
                                         m(1)*d2(5, k) - m(2)*d2(4, k)]
            end do
            d(4:6, :) = matmul(d2(4:6, :), d(1:3, :)) + matmul(e2, d(4:6, :))
            d(1:3, :) = matmul(d2(1:3, :), d(1:3, :))
        end do
    end function by_duals

    !> Nanoseconds of a step of 0.05 with free_flow, then with each method.
    function costs() result(ns)
        real(wp) :: ns(rivals + 1)
        integer, parameter :: rounds = 200, calls = 100
        type(free_case) :: item
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), phi(6, 6), d(6, 3), sum_of, nodes(points), weights(points)
        integer(int64) :: from, to, rate
        integer :: i, k, round

        item%moments = [0.6_wp, 0.8_wp, 1.0_wp]
        item%m0 = [0.5_wp, 0.6_wp, 0.6_wp]
        item%t = 0.05_wp
        body = rigid_body(item%moments)
        call gauss_legendre(points, nodes, weights)
        ns = huge(ns)
        sum_of = 0.0_wp
        do round = 1, rounds
            do i = 1, rivals + 1
                m = item%m0
                q = no_turn
                call system_clock(from, rate)
                do k = 1, calls
                    select case (i)
                    case (1)
                        call free_flow(body, item%t, m, q)
                    case (2)
                        call flow_tangent(body, item%t, m, q, phi)
                    case (3)
                        call free_flow(body, item%t, m, q)
                        d = by_differences(item)
                        sum_of = sum_of + d(1, 1)
                    case default
                        call dual_step(item%moments, m, item%t, nodes, weights, d, phi(:, 1:3))
                        sum_of = sum_of + d(1, 1)
                    end select
                end do
                call system_clock(to)
                ns(i) = min(ns(i), real(to - from, wp)/rate/calls*1.0e9_wp)
            end do
        end do
        if (.not. abs(sum_of) < huge(sum_of)) ns = failed
    end function costs

    subroutine draw_tangent(options, cost)
        type(settings), intent(in) :: options
        real(wp), intent(in) :: cost(rivals + 1)
        type(chart_file) :: file
        character(60) :: label
        integer :: p, i

        call open_script(options, 'tangent', 1000, 1080, file)
        call begin_panels(file, 'Largest error of '//either(options%quick, '1', '3')// &
                          ' random cases: J = dm''/dm (lines), W = dθ''/dm (dashed)')
        do p = 1, panels
            call begin_panel(file, p, [character(80) :: 'set xrange [3e-9:1e3]', &
                'set xtics ("10^{-8}" 1e-8, "10^{-4}" 1e-4, "1" 1, "10^2" 1e2)'])
            do i = rivals, 1, -1
                write (file%line, '(a,i0,a)') '  "tangent.dat" index ', (p - 1)*rivals + i - 1, &
                    ' using 1:2 with linespoints lw 2 pt 7 ps 0.4 lc rgb '//trim(colours(i))//', \'
                call file%put()
                write (file%line, '(a,i0,a)') '  "tangent.dat" index ', (p - 1)*rivals + i - 1, &
                    ' using 1:3 with lines lw 2 dt 2 lc rgb '//trim(colours(i))//', \'
                call file%put()
            end do
            call file%put('  NaN notitle')
        end do
        call begin_legend(file, 'maxrows 2 samplen 2.2 spacing 1.3')
        do i = 1, rivals
            write (label, '(a,f0.1,a)') ' (', cost(i + 1)/cost(1), ' times the step)'
            call file%put('  NaN with linespoints lw 2 pt 7 lc rgb '//trim(colours(i))//' title "'// &
                trim(legend(i))//trim(label)//'", \')
        end do
        call file%put_lines([character(width) :: '  NaN notitle', 'unset multiplot'])
        call file%finish()
        call draw(options, 'tangent')
    end subroutine draw_tangent

end module frb_chart_tangent
